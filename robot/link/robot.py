"""The simulated H1 behind its interface: messages in, messages out.

    torque = tau + kp (q - q_joint) + kd (dq - dq_joint)

The torque is clipped to the motor's largest, and a motor at its largest speed does not accelerate.
Joints are damped until the first command, and again from the next physics step on if no command
came within the watchdog's time.
"""

import hashlib
import math
from dataclasses import dataclass

import numpy as np

from spikeport.errors import UsageError
from spikeport.robot.engine import mujoco
from spikeport.robot.link.codec import (
    TICK_S,
    Base,
    Command,
    decode_command,
    encode_base,
    encode_state,
)
from spikeport.robot.link.h1 import (
    DAMPING,
    SPEED_LIMITS_RAD_S,
    TORQUE_LIMITS_NM,
    check_commands,
)
from spikeport.robot.link.hoist import Held, Hoist
from spikeport.robot.link.odometer import SimulatedOdometer
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.wire import MessageError
from spikeport.robot.plant import Plant
from spikeport.robot.signals import MotorCommands, Sensors

LETS_GO_S = 4.0
"""Time from the start of lowering until the hoist lets go of a standing robot by itself."""
_IMU = ("orientation", "gyro", "acceleration")


@dataclass
class Refusals:
    """Counts of the messages that a robot did not obey, by reason.

    Attributes
    ----------
    damaged : int
        Messages of another size, or with a wrong checksum.
    beyond_limits : int
        Messages with a number that is not finite, or that motors must not obey.
    second_writer : int
        Messages from another writer than the first.
    sport_mode : int
        Messages that came while sport mode commanded.
    """

    damaged: int = 0
    beyond_limits: int = 0
    second_writer: int = 0
    sport_mode: int = 0


class SimulatedRobot:
    """The robot's end of its interface, without a link or a clock.

    Parameters
    ----------
    settings : RobotSettings
        The robot's settings.

    Attributes
    ----------
    tick : int
        The robot's time in ms. It begins at the length of a step, since controllers wait for a
        tick that is not 0.
    step_ticks : int
        Length of a step, in ms.
    steps : int
        Steps since the robot began.
    refusals : Refusals
        The counts of messages that the robot did not obey.
    watchdog_trips : int
        The number of times that the watchdog damped the robot.
    last_refusal : str
        The reason of the last refusal of a message.
    sport_mode : str
        The mode that commands the robot instead of a controller; empty if none does.
    hoist : Hoist
        The robot's hoist.

    Raises
    ------
    UsageError
        A joint's posture is beyond its stops.
    """

    def __init__(self, settings: RobotSettings) -> None:
        self._settings = settings
        self._plant = Plant(anchored=settings.hoist)
        for joint, rad in settings.posture_rad.items():
            low, high = self._plant.model.joint(joint).range
            if not low <= rad <= high:
                raise UsageError(
                    f"{joint}={rad:g}: must be between the joint's stops, {low:g} and {high:g} rad"
                )
        # The plant, too, reads its step from the model.
        self._plant.model.opt.timestep = 1 / settings.rate_hz
        self.step_ticks = round(1 / (TICK_S * settings.rate_hz))
        self._limits = self._plant.model.actuator_forcerange
        self._imu = [self._plant.data.sensor(f"torso_{name}").data for name in _IMU]
        self.restart()

    def restart(self) -> None:
        """Begin anew, as after a power cycle: in the first posture, obeying nobody."""
        settings, model = self._settings, self._plant.model
        self._limits[:] = np.stack((-TORQUE_LIMITS_NM, TORQUE_LIMITS_NM), axis=1)
        self._plant.damp()  # the plant does not know the gains that were commanded since
        self._plant.reset(settings.seed, posture_rad=settings.posture_rad)
        # MuJoCo's force is gain ctrl + bias_1 q + bias_2 dq: `_drive` puts -kp and -kd into the
        # biases.
        model.actuator_gainprm[:, 0] = 1.0
        model.actuator_biasprm[:, 0] = 0.0
        self.tick = self.step_ticks
        self.steps = 0
        # A report covers one controller's run.
        self.refusals, self.last_refusal = Refusals(), ""
        self.watchdog_trips = 0
        self.sport_mode, self.hoist = settings.sport_mode, Hoist(self._plant)
        self._pulls = self._times_of_pulls()
        self._odometer = (
            SimulatedOdometer(settings.odometer, settings.seed, TICK_S * self.step_ticks)
            if settings.odometer
            else None
        )
        self._odometry: bytes | None = None
        self._read_at: int | None = None
        self._writer: int | None = None
        self._obeyed_at: int | None = None
        self._damped = False
        self._motion = hashlib.sha256()
        self._drive(DAMPING)
        mujoco.mj_forward(model, self._plant.data)

    def _times_of_pulls(self) -> dict[Held, int]:
        """Return the steps after which the hoist of a robot that hangs, or stands, is pulled."""
        begin_s, step_s = self._settings.let_down_s, TICK_S * self.step_ticks
        if begin_s is None:
            return {}
        # A robot that is still on its way down at that time is let go of once it stands.
        times_s = {Held.HANGS: begin_s, Held.STANDS: begin_s + LETS_GO_S}
        return {held: round(at_s / step_s) for held, at_s in times_s.items()}

    @property
    def seed(self) -> int:
        """The seed of the robot, which draws its posture and the faults of its link."""
        return self._settings.seed

    # commands

    def read(self, message: bytes, writer: int) -> Command | None:
        """Return the command of a message; count the message and return None if it is refused.

        The robot obeys the first writer of a valid command, until that writer is gone.
        """
        if self._writer not in (None, writer):
            self._refuse("second_writer", "the robot obeys another writer; only one at a time")
            return None
        try:
            command = decode_command(message)
        except MessageError as error:
            self._refuse("damaged", str(error))
            return None
        if self.sport_mode:
            self._refuse(
                "sport_mode", f"the robot is in mode '{self.sport_mode}'; release it first"
            )
            return None
        # Set only here, so that a damaged command does not make the robot obey its writer.
        self._writer = writer
        return command

    def is_left(self, writers: list[int]) -> bool:
        """Return whether the writer that the robot obeys is no longer among the writers."""
        return self._writer is not None and self._writer not in writers

    @property
    def controller(self) -> int:
        """The number of the writer that the robot obeys; 0 for none yet."""
        return self._writer or 0

    def forget_writer(self) -> None:
        """Let another writer take over."""
        self._writer = None

    def obey(self, command: Command) -> None:
        """Drive the motors by a command; refuse and count one that motors must not obey."""
        try:
            check_commands(command.motors)
        except MessageError as error:
            self._refuse("beyond_limits", str(error))
            return
        self._obeyed_at, self._damped = self.tick, False
        self._drive(command.motors)

    def _refuse(self, reason: str, words: str) -> None:
        setattr(self.refusals, reason, getattr(self.refusals, reason) + 1)
        self.last_refusal = words

    def _drive(self, motors: MotorCommands) -> None:
        model = self._plant.model
        model.actuator_biasprm[:, 1], model.actuator_biasprm[:, 2] = -motors.kp, -motors.kd
        self._plant.data.ctrl[:] = motors.tau + motors.kp * motors.q + motors.kd * motors.dq

    # time

    @property
    def waits(self) -> bool:
        """True until a command was obeyed."""
        return self._obeyed_at is None

    def step(self) -> None:
        """Advance the physics by a step, damped if the watchdog says so.

        Raises
        ------
        DivergedError
            If the simulation diverged.
        """
        self._watch()
        self._limit_speeds()
        if self.steps >= self._pulls.get(self.hoist.held, math.inf):
            self.hoist.advance()
        self.hoist.step()
        self._plant.step()
        self.tick += self.step_ticks
        self.steps += 1
        # A digest of every bit of the motion: two runs are equal if their digests are.
        self._motion.update(self._plant.data.qpos.tobytes())
        self._motion.update(self._plant.data.qvel.tobytes())

    def _watch(self) -> None:
        """Go into damping if nobody commanded for too long."""
        if self._obeyed_at is None or self._damped:
            return
        if TICK_S * (self.tick - self._obeyed_at) >= self._settings.watchdog_s:
            self._damped = True
            self.watchdog_trips += 1
            self._drive(DAMPING)

    def _limit_speeds(self) -> None:
        """Let a motor at its largest speed brake, but not accelerate."""
        speeds = self._plant.data.qvel[6:]
        # Torque along the motion is cut off, torque against it is not.
        self._limits[:, 1] = np.where(speeds >= SPEED_LIMITS_RAD_S, 0.0, TORQUE_LIMITS_NM)
        self._limits[:, 0] = np.where(speeds <= -SPEED_LIMITS_RAD_S, 0.0, -TORQUE_LIMITS_NM)

    # states

    def sensors(self) -> Sensors:
        """Return the sensors' observation; its arrays are views of the simulation, and change."""
        data = self._plant.data
        time_s, (quaternion, rates, forces) = TICK_S * self.tick, self._imu
        angles, velocities, torques = data.qpos[7:], data.qvel[6:], data.actuator_force
        return Sensors(time_s, quaternion, rates, forces, angles, velocities, torques)

    def state(self) -> bytes:
        """Return the message of the sensors' observation."""
        return encode_state(self.tick, self.sensors())

    def truth(self) -> bytes:
        """Return the message of the pelvis' motion in the world."""
        return encode_base(self._base())

    def odometry(self) -> bytes | None:
        """Return the message of its odometer, which is read once a step; None without one."""
        if self._odometer is None:
            return None
        if self._read_at != self.steps:
            self._odometry = encode_base(self._odometer.read(self._base()))
            self._read_at = self.steps
        return self._odometry

    def _base(self) -> Base:
        data = self._plant.data
        return Base(self.tick, data.qpos[:3], data.qvel[:3], data.qpos[3:7])

    def summary(self) -> dict[str, object]:
        """Return a summary; ``motion`` is a digest of all positions and velocities, float64."""
        return {
            "steps": self.steps,
            "motion": self._motion.hexdigest()[:12],
            "watchdog_trips": self.watchdog_trips,
            "refused": dict(vars(self.refusals)),
            "last_refusal": self.last_refusal,
        }
