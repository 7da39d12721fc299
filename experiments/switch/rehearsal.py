"""A schedule done by the exact controllers: what the spiking arm is made for.

The exact controllers switch at once, where the schedule wants it.
"""

from typing import NamedTuple

import numpy as np

from spikeport.errors import UsageError
from spikeport.experiments.arm.loop import Recording as ArmRecording
from spikeport.experiments.switch.goals import Goal
from spikeport.experiments.switch.loop import INPUTS, OUTPUTS, SwitchLoop
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.networks.humanoid import ACTIONS
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.path_following import FollowerGains, exact_command
from spikeport.networks.region import ArmRegion
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.walk_interface import CONTROL_DT_S

SEEDS = (1000, 1001, 1002)
"""No evaluation uses them."""
PHYSICS_DT_S = 0.005


class Exact(NamedTuple):
    """The exact controllers: the arm's law, the policy, the path follower's gains."""

    law: OperationalSpaceLaw
    policy: WalkingPolicy
    gains: FollowerGains

    def outputs(self, shown: np.ndarray, anchored: bool) -> np.ndarray:
        """What a controller gives for what it is shown, see `switch_loop`."""
        observation, reference, state, arm, target, wanted = np.split(shown, OUTPUTS[:-1])
        gates = np.eye(len(ACTIONS))[wanted.argmax()]
        walks, draws = gates
        q, dq, hand = arm[:4], arm[4:8], arm[8:]
        action = self.policy(observation) * (walks if anchored else 1.0)
        command = walks * exact_command(self.gains, reference, state)
        torque = self.law.torque(q, dq, target - hand) if draws else np.zeros(4)
        return np.concatenate((action, command, torque, gates))


def rehearse(trial: SwitchTrial, exact: Exact) -> ArmRegion:
    """The states of the arm while it works, in some runs of a trial's schedule.

    Raises
    ------
    UsageError
        If the robot falls before its arm is needed.
    """
    anchors = trial.settings.anchor
    loop = SwitchLoop(anchors, None, CONTROL_DT_S, PHYSICS_DT_S)
    arms = []
    for seed in SEEDS:
        draws = _perform(loop, exact, seed, trial.goals(seed), anchors)
        if not draws.any():
            raise UsageError(
                f"{trial.settings.schedule_file}: the exact controllers fall at "
                f"{loop.fallen_at_s:.1f} s, before the arm works; cure: a slower or wider path"
            )
        arms.append(ArmRecording(*(column[draws] for column in loop.arm_recording())))
    whole = ArmRecording(*(np.concatenate(column) for column in zip(*arms, strict=True)))
    error = whole.target - whole.hand
    return ArmRegion.from_recording(whole.q, whole.dq, whole.hand, error, seed=0)


def _perform(
    loop: SwitchLoop, exact: Exact, seed: int, goals: list[Goal], anchored: bool
) -> np.ndarray:
    """(n,) at which physics steps the arm worked."""
    loop.start(seed, goals)
    output, draws = np.zeros(INPUTS[-1]), []
    for _ in range(round(goals[-1].phase.end_s / PHYSICS_DT_S)):
        draws.append(bool(output[-1]))
        output = exact.outputs(loop.step(output), anchored)
        if loop.over:
            break
    return np.array(draws)
