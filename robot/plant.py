"""The robot as a plant: 200 Hz physics under joint commands that are held until changed."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from spikeport.errors import unknown
from spikeport.robot import actuators
from spikeport.robot.description import JOINTS, KD, KP, POSE_RAD, load
from spikeport.robot.divergence import Watch
from spikeport.robot.engine import mujoco
from spikeport.robot.feet import Feet, Sole
from spikeport.robot.history import History
from spikeport.robot.state import PELVIS, RobotState, read
from spikeport.robot.terrain import LEVEL, Floor

DAMPING_KD = 8.0
"""In N m s/rad. Source: unitree_rl_gym, the damping command of its deployment."""


class Plant:
    """The H1 on a floor; a new one was reset with seed 0.

    Parameters
    ----------
    anchored : bool
        True if `reset` welds the pelvis to the world at 1.06 m and locks the torso upright.
    appearance : str
        As `description.load`, which makes the model if there is none.
    model : mujoco.MjModel, optional
        The compiled robot on its floor.

    Attributes
    ----------
    model, data : mujoco.MjModel, mujoco.MjData
        The simulation; after `step` every position and velocity in ``data`` is of the same moment.
    joints : tuple of str
        The joints in the order of every joint vector.
    """

    joints = JOINTS
    floor: Floor = LEVEL
    """The floor, as it lies under the robot since the last reset."""
    _gain_scale = 1.0
    """The factor on all gains of the joints, those of commands too."""

    def __init__(
        self,
        *,
        anchored: bool = False,
        appearance: str = "primitive",
        model: mujoco.MjModel | None = None,
    ) -> None:
        self.model = load(appearance) if model is None else model
        self.data = mujoco.MjData(self.model)
        # Kept, as MuJoCo makes a new view at each access.
        self._qpos, self._qvel = self.data.qpos, self.data.qvel
        self._pelvis = self.data.xmat[PELVIS]
        self._anchored_at_reset = anchored
        self._watch = Watch(self.model)
        self._history = History(self.model)
        self._modes: dict[tuple[str, ...], object] = {}
        self._weld = self.model.equality("anchor").id
        self._lock = self.model.equality("torso_lock").id
        self._feet = Feet(self.model)
        self._hands = {side: self.model.site(f"{side}_hand").id for side in ("left", "right")}
        self._weakest, self._strongest = self.model.actuator_forcerange.T.copy()
        # Not a subclass's: it has begun no attribute of its own yet.
        Plant.reset(self, 0)

    @property
    def dt_s(self) -> float:
        """Length of one step, s."""
        return float(self.model.opt.timestep)

    @property
    def time_s(self) -> float:
        """Simulated time since `reset`, s."""
        return float(self.data.time)

    @property
    def state(self) -> RobotState:
        """The present motion of the robot, as its controllers observe it."""
        return read(self.data)

    @property
    def in_plane(self) -> np.ndarray:
        """Heading in rad, place in m and velocity in m/s, (5,), as controllers observe it."""
        return self.true_in_plane

    @property
    def start(self) -> np.ndarray:
        """Heading in rad and place in m, (3,), of the last reset, as controllers observe them."""
        return np.zeros(3)  # a reset puts the robot there

    @property
    def true_in_plane(self) -> np.ndarray:
        """Heading in rad, place in m and velocity in m/s, (5,), in the world."""
        heading_rad = np.arctan2(self._pelvis[3], self._pelvis[0])
        return np.array((heading_rad, *self._qpos[:2].tolist(), *self._qvel[:2].tolist()))

    @property
    def true_data(self) -> mujoco.MjData:
        """The true pose, angular velocity of the pelvis, and contacts, for recordings."""
        return self.data

    @property
    def height_m(self) -> float:
        """Height of the pelvis above the floor beneath it."""
        return float(self._qpos[2]) - self._floor_m(self._qpos)

    @property
    def standing_height_m(self) -> float:
        """Height of the pelvis above the floor on which the robot stands.

        Where the floor is a plane, this is the floor beneath the pelvis, whichever foot is lowest;
        elsewhere it is the one beneath the lowest sole.
        """
        if self.floor.is_plane:
            return self.height_m
        return float(self._qpos[2]) - self._sole().floor_m

    @property
    def anchored(self) -> bool:
        """True while the pelvis is welded to the world."""
        return bool(self.data.eq_active[self._weld])

    def reset(
        self,
        seed: int,
        *,
        posture_rad: Mapping[str, float] = MappingProxyType({}),
        perturbation_rad: float = 0.02,
    ) -> None:
        """Start over near a pose, which all joints hold with their default gains.

        A free robot stands with its lowest sole on the floor; an anchored one hangs with its pelvis
        at 1.06 m and its torso at 0.

        Parameters
        ----------
        seed : int
            Seed of the posture; the same seed gives the same run, bit for bit.
        posture_rad : mapping of str to float, optional
            Angles of joints that start elsewhere than in the default pose.
        perturbation_rad : float
            Each joint angle is moved by a random angle, uniform within +- this.

        Raises
        ------
        UsageError
            A joint is not known, or an angle is not finite; the robot is as before.
        """
        pose = pose_with(posture_rad)
        mujoco.mj_resetData(self.model, self.data)
        noise = np.random.RandomState(seed).uniform(-1, 1, len(JOINTS)) * perturbation_rad
        self.data.qpos[7:] = pose + noise
        if self._anchored_at_reset:
            self.data.joint("torso").qpos = 0.0
            self.anchor()
        else:
            self.data.qpos[2] -= self.lowest_sole_m()
            self.release()
        self.hold(JOINTS, pose)
        self._history.clear()
        self._history.record(self.data)

    def anchor(self, pose: ArrayLike | None = None, torso_rad: float | None = None) -> None:
        """Weld the pelvis to the world and lock the torso.

        Parameters
        ----------
        pose : array_like, (7,), optional
            Position in m and orientation (w, x, y, z) of the pelvis; by default the present ones.
            The weld is elastic, so move a robot in small steps.
        torso_rad : float, optional
            Angle of the torso; by default the present one.
        """
        pose = self.data.qpos[:7] if pose is None else np.asarray(pose, dtype=float)
        torso_rad = self.data.joint("torso").qpos[0] if torso_rad is None else torso_rad
        # weld: anchor point (3), pose of the pelvis in the world (7), weight of the rotation (1)
        self.model.eq_data[self._weld, :11] = [0, 0, 0, *pose, 1]
        self.model.eq_data[self._lock, 0] = torso_rad
        self._set_anchored(True)

    def release(self) -> None:
        """Let pelvis and torso move freely."""
        self._set_anchored(False)

    def hold(
        self,
        joints: Sequence[str],
        targets_rad: ArrayLike,
        kp: ArrayLike | None = None,
        kd: ArrayLike | None = None,
    ) -> None:
        """Drive joints to angles and hold them there until another command.

        torque = kp (target - q) - kd dq, clipped to the torque limit.

        Parameters
        ----------
        joints : sequence of str
            Names, see `joints`.
        targets_rad : array_like, () or (n,)
            Target angles.
        kp, kd : array_like, () or (n,), optional
            Gains in N m/rad and N m s/rad; by default those of ``description.GAINS``. The `gains`
            of a perturbation scales either.

        Raises
        ------
        UsageError
            A joint is not known, or a number is missing or not finite.
        """
        index = actuators.indices(joints)
        targets = actuators.values("targets_rad", targets_rad, joints)
        mode = "position" if kp is None and kd is None else object()  # own gains: like no other
        if self._take_mode(mode, joints):
            kp = KP[index] if kp is None else kp
            kd = KD[index] if kd is None else kd
            kps, kds = actuators.values("kp", kp, joints), actuators.values("kd", kd, joints)
            scale = self._gain_scale
            actuators.set_position_mode(self.model, index, scale * kps, scale * kds)
        self.data.ctrl[index] = targets

    def damp(self) -> None:
        """Brake all joints and hold none: torque = -DAMPING_KD dq, until commanded otherwise.

        As with `hold`, the `gains` of a perturbation scales the damping.
        """
        self.hold(JOINTS, 0.0, kp=0.0, kd=DAMPING_KD)

    def torque(self, joints: Sequence[str], torques_nm: ArrayLike) -> None:
        """Apply torques, clipped to the torque limits, until another command.

        Parameters
        ----------
        joints : sequence of str
            Names, see `joints`.
        torques_nm : array_like, () or (n,)
            Torques, N m.

        Raises
        ------
        UsageError
            A joint is not known, or a number is missing or not finite.
        """
        index = actuators.indices(joints)
        torques = actuators.values("torques_nm", torques_nm, joints)
        if self._take_mode("torque", joints):
            actuators.set_torque_mode(self.model, index)
        weakest, strongest = self._weakest[index], self._strongest[index]
        self.data.ctrl[index] = np.minimum(np.maximum(torques, weakest), strongest)

    def _take_mode(self, mode: object, joints: Sequence[str]) -> bool:
        """Keep the mode of joints; return False if they have it already.

        Setting the mode of actuators takes longer than a physics step: it is not repeated.
        """
        together = tuple(joints)
        if self._modes.get(together) == mode:
            return False
        # Forget every other group with one of these joints: its joints may now be in different
        # modes.
        others = {k: m for k, m in self._modes.items() if not set(k) & set(together)}
        self._modes = {**others, together: mode}
        return True

    def step(self) -> None:
        """Advance the physics by ``dt_s``.

        Raises
        ------
        DivergedError
            A quantity of the state is not finite or out of the bounds of `divergence.Watch`.
        """
        # Second half of this step, then first half of the next: sites, pictures, and sensors of
        # position and velocity then show the new state, not the one before it. Forces, contact
        # sensors and accelerometers are those of the step that led to it.
        mujoco.mj_step2(self.model, self.data)
        self._watch.check(self._history.record(self.data), self.data.time)
        mujoco.mj_step1(self.model, self.data)

    def close(self) -> None:
        """Release the robot; a simulation has nothing to release."""

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the link to the robot; None for a simulation without a link."""
        return None

    def history(self) -> dict[str, np.ndarray]:
        """Return the last 200 states, oldest first: ``time_s``, ``qpos``, ``qvel``, ``ctrl``."""
        return self._history.arrays()

    def motion(self, joints: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Return the angles in rad and velocities in rad/s of some joints, ``(n,)`` each."""
        index = actuators.indices(joints)
        return self._qpos[7:][index], self._qvel[6:][index]

    def hand_position(self, side: str = "right") -> np.ndarray:
        """Return the centre of a hand in the world, m, ``(3,)``; ``side`` is "left" or "right"."""
        if side not in self._hands:
            raise unknown("side", side, self._hands)
        return np.array(self.data.site_xpos[self._hands[side]])

    def _set_anchored(self, anchored: bool) -> None:
        self.data.eq_active[[self._weld, self._lock]] = anchored
        mujoco.mj_forward(self.model, self.data)

    def lowest_sole_m(self) -> float:
        """Return the height of the lowest sole above the floor beneath it."""
        return self._sole().above_m

    def _sole(self) -> Sole:
        mujoco.mj_kinematics(self.model, self.data)
        return self._feet.sole(self.data, self._floor_m, self.floor.is_plane)

    def _floor_m(self, place: np.ndarray) -> float:
        """Return the height of the floor beneath a place (3,) of the world."""
        if self.floor is LEVEL:  # asked in every step
            return 0.0
        return float(self.floor.height_m(place[:1], place[1:2])[0])


def pose_with(posture_rad: Mapping[str, float]) -> np.ndarray:
    """Return the default pose, (19,) in rad, with other angles of some joints."""
    joints, pose = tuple(posture_rad), POSE_RAD.copy()
    index = actuators.indices(joints)
    pose[index] = actuators.values("posture_rad", list(posture_rad.values()), joints)
    return pose
