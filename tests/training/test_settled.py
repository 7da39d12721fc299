"""The motion of robots once it has settled."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from spikeport.training import settled as module
from spikeport.training.commands import CommandRange
from spikeport.training.randomisation import UNDISTURBED


class Robots:
    """Robots whose motion is the number of their steps."""

    made: tuple = ()
    closed = False

    def __init__(self, *arguments):
        type(self).made, self.motion = arguments, 0

    def observe(self):
        return np.zeros((2, 69))

    def step(self, _actions):
        self.motion += 1

    def close(self):
        type(self).closed = True


def test_motion_counts_from_the_time_it_has_settled(monkeypatch):
    monkeypatch.setattr(module, "WalkEnvironment", Robots)
    commands = CommandRange()
    found = list(module.settled(lambda observed: observed, commands, 2, 7))
    assert found == list(range(151, 501))  # steps of 20 ms, after 3 s of 10 s
    n, task, seed = Robots.made
    assert (n, task.commands, task.randomisation, seed) == (2, commands, UNDISTURBED, 7)
    assert Robots.closed
