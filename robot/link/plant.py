"""A plant whose physics is at the other end of a robot's interface.

Controllers drive it like a `spikeport.robot.plant.Plant`. A step sends the commands of the joints,
and takes the robot's answer as the present state. The model here is moved to that state, for
kinematics, contacts and pictures, and never steps.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from spikeport.errors import RobotLostError
from spikeport.robot.engine import mujoco
from spikeport.robot.estimator.base import Fix
from spikeport.robot.link.client import RobotClient
from spikeport.robot.link.codec import TICK_S
from spikeport.robot.link.motion import MotionSource, unrounded
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.plant import Plant
from spikeport.robot.signals import MotorCommands
from spikeport.robot.state import RobotState, in_plane


class LinkedPlant(Plant):
    """The H1 behind its interface.

    Parameters
    ----------
    connect : callable
        Returns a robot to control, for the settings of a simulated robot; an existing robot has
        its own settings.
    estimator : callable
        Returns a source of the robot's motion, for the place where a hoist holds its pelvis, or
        None; called for each run, since estimators have a state.
    anchored, appearance
        As `Plant`; an anchored robot hangs on its hoist.
    """

    def __init__(
        self,
        connect: Callable[[RobotSettings], RobotClient],
        estimator: Callable[[Fix | None], MotionSource],
        *,
        anchored: bool = False,
        appearance: str = "primitive",
    ) -> None:
        self._connect, self._estimator = connect, estimator
        self._robot: RobotClient | None = None
        self._link: dict[str, object] | None = None
        self._true: RobotState | None = None
        self._start = np.zeros(3)
        super().__init__(anchored=anchored, appearance=appearance)
        self._true_data = mujoco.MjData(self.model)
        # The history so far has the model's own posture, in which no robot was.
        self._history.clear()

    def reset(
        self,
        seed: int,
        *,
        posture_rad: Mapping[str, float] = MappingProxyType({}),
        perturbation_rad: float = 0.02,
    ) -> None:
        """Start over with a robot; see `Plant.reset`.

        ``perturbation_rad`` moves the model that is computed here; the robot has a default of its
        own.

        Raises
        ------
        BackendError
            If there is no robot.
        """
        super().reset(seed, posture_rad=posture_rad, perturbation_rad=perturbation_rad)
        self._history.clear()  # as after the constructor
        self.close()
        settings = RobotSettings(
            rate_hz=1 / self.dt_s,
            hoist=self._anchored_at_reset,
            seed=seed,
            posture_rad=posture_rad,
        )
        self._robot = self._connect(settings)
        hoist = Fix(self.data.qpos[:3].copy(), 0.0) if self._anchored_at_reset else None
        self._motion = self._estimator(hoist)
        self._observed = self._robot.first()
        self._begun_tick = self._observed.asks
        self._show()
        self._start = unrounded(self.in_plane[:3])
        self._history.record(self.data)

    def step(self) -> None:
        """Command the robot, and take its next state.

        Raises
        ------
        RobotLostError
            If no state comes, or the motion that is observed or estimated is out of bounds.
        """
        assert self._robot is not None
        self._observed = self._robot.exchange(self._observed, self._commands())
        self._show()
        if outside := self._watch.outside(self._history.record(self.data)):
            raise RobotLostError(f"the robot's motion is not believed: {outside}")

    def close(self) -> None:
        """Leave the robot."""
        if self._robot is not None:
            robot, self._robot = self._robot, None
            robot.close()
            self._link = self._figures(robot)

    @property
    def has_own_clock(self) -> bool:
        """True while the robot is connected: it may be held, or miss a step."""
        return self._robot is not None

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the link, and of the estimator."""
        return self._link if self._robot is None else self._figures(self._robot)

    @property
    def start(self) -> np.ndarray:
        """Heading in rad and place in m, (3,), of the first observation, by the estimator."""
        return self._start

    @property
    def in_plane(self) -> np.ndarray:
        """Heading in rad, place in m and velocity in m/s, (5,), by the estimator."""
        return super().true_in_plane

    @property
    def true_in_plane(self) -> np.ndarray:
        """Heading, place and velocity, (5,), by the truth if it is published."""
        return super().true_in_plane if self._true is None else in_plane(self._true)

    @property
    def true_data(self) -> mujoco.MjData:
        """The pose, angular velocity and contacts by the truth if it is published."""
        return self.data if self._true is None else self._true_data

    @property
    def height_m(self) -> float:
        """Height of the pelvis above the floor, by the truth if it is published."""
        return super().height_m if self._true is None else float(self._true.base_position[2])

    def _figures(self, robot: RobotClient) -> dict[str, object]:
        return {**robot.summary(), "estimator": self._motion.summary()}

    def _commands(self) -> MotorCommands:
        """Return the commands that the model's actuators are set to.

        torque = gain ctrl + bias . (1, q, dq) with bias = (0, -kp, -kd).
        """
        model, ctrl = self.model, self.data.ctrl
        kp, kd = -model.actuator_biasprm[:, 1], -model.actuator_biasprm[:, 2]
        none = np.zeros(len(ctrl))
        # A position command has gain kp, so its tau is 0; a torque command has kp 0.
        tau = (model.actuator_gainprm[:, 0] - kp) * ctrl
        return MotorCommands(np.where(kp > 0, ctrl, none), none, kp, kd, tau)

    def _show(self) -> None:
        """Move the model to the present state."""
        state, data = self._motion(self._observed), self.data
        self._true = self._motion.true
        data.qpos[:] = np.concatenate((state.base_position, state.base_quaternion, state.q))
        data.qvel[:] = np.concatenate((np.zeros(3), state.base_angular_velocity, state.dq))
        data.time = TICK_S * (self._observed.asks - self._begun_tick)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
        # MuJoCo keeps a free joint's linear velocity in the world, its angular one in the body.
        data.qvel[:3] = rotation.reshape(3, 3) @ state.base_linear_velocity
        # Kinematics, contacts and sensors at this state, without a step of the physics.
        mujoco.mj_step1(self.model, data)
        if self._true is not None:
            self._show_truth(self._true)

    def _show_truth(self, true: RobotState) -> None:
        """Move the model of recordings to the true pose; a foot may touch the floor in it alone."""
        data = self._true_data
        data.qpos[:] = np.concatenate((true.base_position, true.base_quaternion, true.q))
        data.qvel[3:6] = true.base_angular_velocity
        mujoco.mj_fwdPosition(self.model, data)
