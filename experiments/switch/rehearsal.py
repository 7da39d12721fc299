"""A schedule done by the exact controllers: what the spiking ones are made for.

The exact controllers switch at once, where the schedule wants it.
"""

import functools
from collections.abc import Callable, Iterator
from typing import NamedTuple, Self

import numpy as np

from spikeport.errors import UsageError
from spikeport.experiments.arm.loop import Recording as ArmRecording
from spikeport.experiments.policy.calibration import Policy, Walks
from spikeport.experiments.switch.goals import Goal
from spikeport.experiments.switch.loop import INPUTS, OUTPUTS, SwitchLoop
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.experiments.walk.gait import drift_trim, record_gait
from spikeport.experiments.walk.loop import OBSERVATION_DT_S
from spikeport.networks.humanoid import ACTIONS
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.path_following import FollowerGains, exact_command
from spikeport.networks.region import ArmRegion
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.arm import ArmDynamics

SEEDS = (1000, 1001, 1002)
"""No evaluation uses them."""


class Exact(NamedTuple):
    """The exact controllers: the arm's law, the policy, the path follower's gains."""

    law: OperationalSpaceLaw
    policy: WalkingPolicy
    gains: FollowerGains

    @classmethod
    def of(cls, settings: SwitchSettings) -> Self:
        """Those of some settings; raises UsageError if their policy is not for this robot."""
        law = OperationalSpaceLaw(ArmDynamics())
        return cls(law, settings.walking_policy(), FollowerGains())

    def outputs(self, shown: np.ndarray, anchored: bool, policy: Policy) -> np.ndarray:
        """What a controller gives for what it is shown, see `experiments.switch.loop`.

        ``policy`` walks in place of the exact one.
        """
        observation, reference, state, arm, target, wanted = np.split(shown, OUTPUTS[:-1])
        gates = np.eye(len(ACTIONS))[wanted.argmax()]
        walks, draws = gates
        q, dq, hand = arm[:4], arm[4:8], arm[8:]
        action = policy(observation) * (walks if anchored else 1.0)
        command = walks * exact_command(self.gains, reference, state)
        torque = self.law.torque(q, dq, target - hand) if draws else np.zeros(4)
        return np.concatenate((action, command, torque, gates))


class Rehearsed(NamedTuple):
    """The states of the arm while it works, and all (n, 69) that the policy is told in charge."""

    region: ArmRegion
    observations: np.ndarray


def rehearse(trial: SwitchTrial, exact: Exact) -> Rehearsed:
    """Record some runs of a trial's schedule, and a gait.

    A policy that balances is told of the arm at work; one that does not, of walking alone.

    Raises
    ------
    UsageError
        If the robot falls before its arm is needed.
    """
    trial.options.progress("rehearsing with the exact controllers", None)
    told, arms = [], []
    for loop, draws in _performances(trial, exact, exact.policy):
        if not draws.any():
            raise UsageError(
                f"{trial.settings.schedule_file}: the exact controllers fall at "
                f"{loop.fallen_at_s:.1f} s, before the arm works; cure: a slower or wider path"
            )
        told.append(_told(trial, loop, draws))
        arms.append(ArmRecording(*(column[draws] for column in loop.arm_recording())))
    whole = ArmRecording(*(np.concatenate(column) for column in zip(*arms, strict=True)))
    error = whole.target - whole.hand
    region = ArmRegion.from_recording(whole.q, whole.dq, whole.hand, error, seed=0)
    return Rehearsed(region, np.concatenate((record_gait(exact.policy), *told)))


def walks(trial: SwitchTrial, exact: Exact) -> Walks:
    """How a robot walks by another policy, see `Walks`."""
    return Walks(functools.partial(_observations, trial, exact), drift_trim)


def _observations(trial: SwitchTrial, exact: Exact, policy: Policy) -> np.ndarray:
    """All (n, 69) that another policy is told in charge, whether the robot falls or not."""
    told = [_told(trial, *performed) for performed in _performances(trial, exact, policy)]
    return np.concatenate((record_gait(policy), *told))


def _told(trial: SwitchTrial, loop: SwitchLoop, draws: np.ndarray) -> np.ndarray:
    return loop.recording().observation[~draws | (not trial.settings.anchor)]


def _performances(
    trial: SwitchTrial, exact: Exact, policy: Policy
) -> Iterator[tuple[SwitchLoop, np.ndarray]]:
    """Runs of the schedule that are over, and at which physics steps the arm worked."""
    anchors = trial.settings.anchor
    loop = SwitchLoop(anchors, None, OBSERVATION_DT_S, OBSERVATION_DT_S)
    drive = functools.partial(exact.outputs, anchored=anchors, policy=policy)
    for seed in SEEDS:
        yield loop, _perform(loop, drive, seed, trial.goals(seed))


def _perform(
    loop: SwitchLoop, drive: Callable[[np.ndarray], np.ndarray], seed: int, goals: list[Goal]
) -> np.ndarray:
    """(n,) at which physics steps the arm worked."""
    loop.start(seed, goals)
    output, draws = np.zeros(INPUTS[-1]), []
    for _ in range(round(goals[-1].phase.end_s / OBSERVATION_DT_S)):
        draws.append(bool(output[-1]))
        output = drive(loop.step(output))
        if loop.over:
            break
    return np.array(draws)
