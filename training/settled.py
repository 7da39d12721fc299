"""The motion of undisturbed robots that follow a constant command, from the time it has settled."""

from collections.abc import Iterator
from contextlib import closing

from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.walk_interface import CONTROL_DT_S
from spikeport.training.commands import CommandRange
from spikeport.training.environment import TrainingTask, WalkEnvironment
from spikeport.training.motion import Motion
from spikeport.training.randomisation import UNDISTURBED

SECONDS, SETTLED_S = 10.0, 3.0
"""Duration of a walk, and the time from which its motion counts."""


def settled(
    policy: WalkingPolicy, commands: CommandRange, robots: int, seed: int
) -> Iterator[Motion]:
    """Yield the motion of all robots after each control step that counts."""
    with closing(WalkEnvironment(robots, TrainingTask(commands, UNDISTURBED), seed)) as env:
        for step in range(round(SECONDS / CONTROL_DT_S)):
            env.step(policy(env.observe()))
            if step >= round(SETTLED_S / CONTROL_DT_S):
                yield env.motion
