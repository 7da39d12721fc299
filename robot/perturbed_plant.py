"""The robot with a perturbation: a changed body and floor, pushes, delays and sensor noise."""

from collections import deque
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from spikeport.robot.actuators import ActuatorCommand
from spikeport.robot.altered import alter
from spikeport.robot.description import specified
from spikeport.robot.engine import mujoco
from spikeport.robot.foot_sensors import add_foot_sensors
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.plant import Plant, pose_with
from spikeport.robot.pushes import Pushes
from spikeport.robot.senses import Senses
from spikeport.robot.state import RobotState
from spikeport.robot.terrain import find_terrain

_STREAM = 1
"""Seeds the draws here together with a run's seed, so that they differ from the posture's."""


class PerturbedPlant(Plant):
    """The H1 under a perturbation, with sensors at its feet.

    Parameters
    ----------
    perturbation : Perturbation
        The differences from `Plant`; their random parts depend on the seed of a run.
    anchored, appearance
        As `Plant`.

    Raises
    ------
    MissingExtraError, UsageError
        As `spikeport.robot.altered.alter`.
    """

    def __init__(
        self,
        perturbation: Perturbation,
        *,
        anchored: bool = False,
        appearance: str = "primitive",
    ) -> None:
        self._perturbation = perturbation
        self.floor = find_terrain(perturbation.terrain)
        self._gain_scale = perturbation.gains
        spec = specified(appearance)
        self.floor.lay(spec)
        alter(spec, perturbation)
        add_foot_sensors(spec)
        super().__init__(anchored=anchored, model=spec.compile())
        self.reset(0)

    def reset(
        self,
        seed: int,
        *,
        posture_rad: Mapping[str, float] = MappingProxyType({}),
        perturbation_rad: float = 0.02,
    ) -> None:
        """Start over; see `Plant.reset`. The seed also determines pushes, noise and floor."""
        pose_with(posture_rad)  # refused before the floor is moved
        asked, rng = self._perturbation, np.random.RandomState([_STREAM, seed])
        self.floor = self.floor.begin(self.model, rng)
        super().reset(seed, posture_rad=posture_rad, perturbation_rad=perturbation_rad)
        self._pushes = Pushes(asked.push, asked.push_every, rng)
        self._commands = deque([self._command()] * self._steps(asked.action_delay))
        self._senses = Senses(self, asked, self._steps(asked.observation_delay), rng)

    def step(self) -> None:
        """Advance the physics by ``dt_s`` under the delayed commands; see `Plant.step`."""
        push = self._pushes.due(self.time_s)
        if push is not None:
            self.data.qvel[:2] += push
            # Recompute the quantities that depend on velocities after the jump.
            mujoco.mj_step1(self.model, self.data)
        if self._commands:
            self._step_late()
        else:
            super().step()
        self._senses.look()

    def _step_late(self) -> None:
        """Advance under the oldest command that is under way."""
        wanted = self._command()
        self._commands.append(wanted)
        self._commands.popleft().set_on(self.model, self.data)
        try:
            super().step()
        finally:
            # Ports read the command that was set, not the delayed one that acts now.
            wanted.set_on(self.model, self.data)

    @property
    def state(self) -> RobotState:
        """The motion of the robot, as its controllers observe it."""
        return self._senses.state

    @property
    def in_plane(self) -> np.ndarray:
        """Heading in rad, place in m and velocity in m/s, (5,), as controllers observe it."""
        return self._senses.in_plane

    def _command(self) -> ActuatorCommand:
        return ActuatorCommand.of(self.model, self.data)

    def _steps(self, delay_s: float) -> int:
        return round(delay_s / self.dt_s)
