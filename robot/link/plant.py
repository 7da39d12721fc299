"""A plant whose physics is at the other end of a robot's interface.

Controllers drive it as they drive a `spikeport.robot.plant.Plant`. A step sends what the joints are
commanded, and takes what comes back for the present state; the model here is moved to it, for
kinematics, contacts and pictures, and never steps.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from spikeport.robot.engine import mujoco
from spikeport.robot.link.client import Observed, RobotClient
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.signals import MotorCommands
from spikeport.robot.plant import Plant
from spikeport.robot.state import RobotState

Estimate = Callable[[Observed], RobotState]
"""Tells the motion of a robot, observation by observation."""


class LinkedPlant(Plant):
    """The H1 as its interface shows it.

    Parameters
    ----------
    connect : callable
        Makes a robot to control, of the settings of a simulated one; a robot that is there already
        is as it is.
    estimator : callable
        Makes what tells the robot's motion from an observation: anew for each run, since
        estimators remember.
    anchored, appearance
        As `Plant`; an anchored robot hangs on its hoist.
    """

    def __init__(
        self,
        connect: Callable[[RobotSettings], RobotClient],
        estimator: Callable[[], Estimate],
        *,
        anchored: bool = False,
        appearance: str = "primitive",
    ) -> None:
        self._connect: Callable[[RobotSettings], RobotClient] | None = None
        self._estimator = estimator
        self._robot: RobotClient | None = None
        self._link: dict[str, object] | None = None
        super().__init__(anchored=anchored, appearance=appearance)
        self._connect = connect  # the reset within Plant's beginning concerns the model alone

    def reset(
        self,
        seed: int,
        *,
        posture_rad: Mapping[str, float] = MappingProxyType({}),
        perturbation_rad: float = 0.02,
    ) -> None:
        """Start over with a robot; see `Plant.reset`.

        Raises
        ------
        BackendError
            If there is none.
        """
        super().reset(seed, posture_rad=posture_rad, perturbation_rad=perturbation_rad)
        if self._connect is None:
            return
        self.close()
        settings = RobotSettings(
            rate_hz=1 / self.dt_s,
            hoist=self._anchored_at_reset,
            seed=seed,
            posture_rad=posture_rad,
        )
        self._robot = self._connect(settings)
        self._estimate = self._estimator()
        self._seen = self._robot.first()
        self._begun_tick = self._seen.tick
        self._show()
        self._history.clear()
        self._history.record(self.data)

    def step(self) -> None:
        """Command the robot, and take its next state.

        Raises
        ------
        RobotLostError
            If none comes.
        DivergedError
            As `Plant.step`.
        """
        assert self._robot is not None
        self._seen = self._robot.exchange(self._seen, self._commands())
        self._show()
        self._watch.check(self._history.record(self.data), self.data.time)

    def close(self) -> None:
        """Leave the robot."""
        if self._robot is not None:
            robot, self._robot = self._robot, None
            robot.close()
            self._link = robot.summary()

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the link."""
        return self._link if self._robot is None else self._robot.summary()

    def _commands(self) -> MotorCommands:
        """Return what the actuators of the model are set to.

        torque = gain ctrl + bias . (1, q, dq), of which bias = (0, -kp, -kd).
        """
        model, ctrl = self.model, self.data.ctrl
        kp, kd = -model.actuator_biasprm[:, 1], -model.actuator_biasprm[:, 2]
        none = np.zeros(len(ctrl))
        tau = (model.actuator_gainprm[:, 0] - kp) * ctrl
        return MotorCommands(np.where(kp > 0, ctrl, none), none, kp, kd, tau)

    def _show(self) -> None:
        """Move the model to the present state."""
        state, data = self._estimate(self._seen), self.data
        data.qpos[:] = np.concatenate((state.base_position, state.base_quaternion, state.q))
        data.qvel[:] = np.concatenate((np.zeros(3), state.base_angular_velocity, state.dq))
        data.time = 0.001 * (self._seen.tick - self._begun_tick)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
        data.qvel[:3] = rotation.reshape(3, 3) @ state.base_linear_velocity
        mujoco.mj_step1(self.model, data)
