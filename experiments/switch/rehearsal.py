"""Rehearsals of a schedule by the exact controllers, for which the spiking ones are made.

The exact controllers switch at once when the schedule does.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport.cache import Arrays
from spikeport.errors import UsageError
from spikeport.experiments.arm.reach_task import rehearsals
from spikeport.experiments.arm.recording import ArmRecording
from spikeport.experiments.arm.region import exact_runs
from spikeport.experiments.policy.calibration import Policy, Walks
from spikeport.experiments.switch.gate import HumanoidRig
from spikeport.experiments.switch.goals import BOX, Goal
from spikeport.experiments.walk.gait import drift_trim, record_gait
from spikeport.experiments.walk.legs import OBSERVATION_DT_S
from spikeport.networks.humanoid import ACTIONS
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.path_following import COMMAND_SIZE, exact_command
from spikeport.networks.region import ArmRegion
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.perturbation import NONE, Perturbation
from spikeport.robot.plant import Plant

SEEDS = (1000, 1001, 1002)
"""The seeds of rehearsals; no table in docs/ uses them."""


class ExactControllers(NamedTuple):
    """The exact controllers: the arm's law, and the policy with its path follower's gains."""

    law: OperationalSpaceLaw
    policy: WalkingPolicy

    def outputs(self, rig: HumanoidRig, anchored: bool, policy: Policy) -> np.ndarray:
        """Return [action, command, torque, gates] for the last observation of a robot's ports.

        ``policy`` walks in place of the exact policy.
        """
        observation, reference, state = rig.walk.inputs
        gates = np.eye(len(ACTIONS))[rig.gate.utilities.argmax()]
        walks, draws = gates
        # A robot that is not held must balance while its arm works.
        action = policy(observation) * (walks if anchored else 1.0)
        gains = self.policy.gains
        command = exact_command(gains, reference, state) if walks else np.zeros(COMMAND_SIZE)
        torque = rig.arm.exact_torque(self.law) if draws else np.zeros(rig.arm.size_in)
        return np.concatenate((action, command, torque, gates))


class Rehearsed(NamedTuple):
    """The states of the arm at work, and the observations (n, 69) of the policy in charge."""

    region: ArmRegion
    observations: np.ndarray

    def arrays(self) -> dict[str, np.ndarray]:
        """Return region and observations as arrays, for a cache."""
        return {**self.region.arrays(), "observations": self.observations}

    @classmethod
    def of(cls, arrays: Arrays) -> "Rehearsed":
        """Return region and observations from arrays of a cache."""
        return cls(ArmRegion.of(arrays), arrays["observations"])


@dataclass(frozen=True)
class Rehearsals:
    """Runs of a schedule by the exact controllers, from seeds of their own.

    Attributes
    ----------
    exact : ExactControllers
        The controllers.
    anchors : bool
        True if the pelvis is held while the arm works. If it is not, the policy balances, and its
        observations while the arm works count, too.
    goals : callable
        Returns the goals of the schedule for a seed.
    file : Path
        The schedule, for messages.
    perturbations : sequence of Perturbation
        Perturbations of the gait, see `spikeport.experiments.walk.gait.record_gait`.
    """

    exact: ExactControllers
    anchors: bool
    goals: Callable[[int], Sequence[Goal]]
    file: Path
    perturbations: Sequence[Perturbation] = (NONE,)

    def record(self) -> Rehearsed:
        """Record the runs, and a gait.

        Raises
        ------
        UsageError
            If the robot falls before its arm is needed.
        """
        observations, arms = [], []
        for rig, draws in self._runs(self.exact.policy):
            if not draws.any():
                raise UsageError(
                    f"{self.file}: the exact controllers fall at {rig.walk.fallen_at_s:.1f} s, "
                    "before the arm works; cure: a slower or wider path"
                )
            # Taken now, since the same rig begins anew for the next seed.
            observations.append(self._observed(rig, draws))
            arms.append(rig.arm.recording().where(draws))
        whole = ArmRecording.join([*arms, *self._reaches()])
        error = whole.target - whole.hand
        region = ArmRegion.from_recording(whole.q, whole.dq, whole.hand, error, seed=0)
        for stroke in self._strokes():
            region = region.holding(stroke)
        gait = record_gait(self.exact.policy, self.perturbations)
        return Rehearsed(region, np.concatenate((gait, *observations)))

    def _reaches(self) -> list[ArmRecording]:
        """Record the arm alone in the box of random targets, if a phase has some.

        The schedule's own runs pass through the targets of a few seeds; a run has others.
        """
        if not any(goal.phase.arm == "reach" for goal in self.goals(SEEDS[0])):
            return []
        return exact_runs(self.exact.law, rehearsals(BOX))

    def _strokes(self) -> list[np.ndarray]:
        """Return the templates (n, 3) of drawings, if the torso is held upright as they are."""
        if not self.anchors:
            return []
        return [goal.stroke for goal in self.goals(SEEDS[0]) if goal.phase.arm == "digit"]

    @property
    def walks(self) -> Walks:
        """The walks of a robot on another policy."""
        return Walks(self._observations, drift_trim)

    def _observations(self, policy: Policy) -> np.ndarray:
        """Return the observations (n, 69) of another policy, whether the robot falls or not."""
        observed = [self._observed(rig, draws) for rig, draws in self._runs(policy)]
        return np.concatenate((record_gait(policy, self.perturbations), *observed))

    def _observed(self, rig: HumanoidRig, draws: np.ndarray) -> np.ndarray:
        """Return the policy's observations while it is in charge."""
        return rig.walk.recording().observation[~draws | (not self.anchors)]

    def _runs(self, policy: Policy) -> Iterator[tuple[HumanoidRig, np.ndarray]]:
        """Yield the rig after each run, and whether the arm worked at each physics step, (n,)."""
        rig = HumanoidRig(Plant(), self.anchors, None, OBSERVATION_DT_S, OBSERVATION_DT_S)
        for seed in SEEDS:
            yield rig, self._run(rig, policy, seed)

    def _run(self, rig: HumanoidRig, policy: Policy, seed: int) -> np.ndarray:
        goals = self.goals(seed)
        rig.begin(seed, goals)
        # One step late, like a network's values.
        output, draws = np.zeros(rig.loop.size_in), []
        for _ in range(round(goals[-1].phase.end_s / OBSERVATION_DT_S)):
            rig.loop.step(output)
            draws.append(rig.arm.drives)
            output = self.exact.outputs(rig, self.anchors, policy)
            if rig.loop.over:
                break
        return np.array(draws)
