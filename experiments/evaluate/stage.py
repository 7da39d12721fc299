"""An episode of a policy: a perturbed robot that obeys random commands, and its recording."""

import math
from dataclasses import dataclass

import numpy as np

from spikeport.experiments.evaluate.commands import RandomCommands
from spikeport.experiments.loop import Loop, Port
from spikeport.experiments.recording import Recording
from spikeport.experiments.walk.legs import LegsPort
from spikeport.networks.region import Box
from spikeport.robot.foot_sensors import VALUES
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.terrain import find_terrain
from spikeport.robot.walk_interface import PARTS


@dataclass(frozen=True)
class EpisodeRecording(Recording):
    """The recording of a robot after every physics step.

    Attributes
    ----------
    qpos, qvel : (n, 26) and (n, 25) array
        MuJoCo's positions and velocities.
    torque_nm : (n, 19) array
        Torques of the joints.
    feet : (n, 32) array
        Values of `spikeport.robot.foot_sensors`.
    command : (n, 3) array
        The command that the policy observes: vx and vy in m/s, wz in rad/s.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    torque_nm: np.ndarray
    feet: np.ndarray
    command: np.ndarray


class Witness(Port):
    """A port that only watches a robot.

    Parameters
    ----------
    plant : PerturbedPlant
        The robot.
    legs : LegsPort
        The port of its legs, served before this port.
    """

    def __init__(self, plant: PerturbedPlant, legs: LegsPort) -> None:
        self._plant, self._legs = plant, legs
        self._rows: list[tuple[object, ...]] = []

    def observe(self) -> np.ndarray:
        """Keep state, forces and command, and return no value."""
        data = self._plant.data
        command = self._legs.observed[PARTS["command"]]
        # The feet's sensors come after all others.
        feet = data.sensordata[-VALUES:]
        states = data.qpos.copy(), data.qvel.copy(), data.actuator_force.copy(), feet.copy()
        self._rows.append((self._plant.time_s, *states, command))
        return np.empty(0)

    def drive(self, _values: np.ndarray) -> None:
        """Drive nothing."""

    def recording(self) -> EpisodeRecording:
        """Return the recording."""
        return EpisodeRecording.of(self._rows)


class Stage:
    """A perturbed robot that obeys random commands; perturbation and commands depend on the seed.

    Parameters
    ----------
    perturbation : Perturbation
        The perturbation of the robot.
    seconds : float
        The time for which it walks.
    seed : int
        Seed of the posture, the commands, and the random parts of the perturbation.
    encoding : Box or None
        Range of the observations that the policy represents.
    observe_every_s, dt_s : float
        Time from one observation of the policy to the next, and from one of its actions.
    """

    def __init__(
        self,
        perturbation: Perturbation,
        seconds: float,
        seed: int,
        encoding: Box | None,
        observe_every_s: float,
        dt_s: float,
    ) -> None:
        self.plant = PerturbedPlant(perturbation)
        self.legs = LegsPort(self.plant, encoding, observe_every_s)
        self.witness = Witness(self.plant, self.legs)
        self.commands = RandomCommands(seconds, seed)
        # The witness is last: the command that it keeps is the one observed in this step.
        self._loop = Loop(self.plant, [self.legs, self.witness], dt_s)
        self.n_steps = round(seconds / dt_s)
        self.plant.reset(seed)
        self._loop.begin()
        self._reach_m = find_terrain(perturbation.terrain).reach_m
        self._start_m = self.plant.data.qpos[:2].copy()

    @property
    def over(self) -> bool:
        """True once the robot fell, or is where an uneven floor may have its edge."""
        return self._loop.over or (
            math.isfinite(self._reach_m)
            and math.dist(self.plant.data.qpos[:2], self._start_m) > self._reach_m
        )

    def advance(self, action: np.ndarray) -> np.ndarray:
        """Advance by a step under an action (19,), and return the policy's observation (69,)."""
        command = self.commands.at(self.plant.time_s)
        return self._loop.step(np.concatenate((action, command)))

    def skip(self) -> int:
        """Skip the steps before the robot's next one; see `Loop.skip`."""
        return self._loop.skip()
