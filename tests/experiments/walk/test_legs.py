import numpy as np
import pytest

from spikeport.errors import DivergedError
from spikeport.experiments.loop import Loop
from spikeport.experiments.walk.legs import LegsPort
from spikeport.networks.region import Box
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import PARTS, POSE_RAD


class Legs:
    """A robot in closed loop by its legs alone, and the observations of its steps."""

    def __init__(self, encoding=None, every_s=0.005):
        self.plant = Plant()
        self.port = LegsPort(self.plant, encoding, every_s)
        self.loop = Loop(self.plant, [self.port], self.plant.dt_s)
        self.plant.reset(0)
        self.loop.begin()
        self.observed = []

    def step(self, action, command=(0.0, 0.0)):
        self.observed.append(self.port.observed)
        return self.loop.step(np.append(action, command))

    def seen(self, part):
        return np.array(self.observed)[:, PARTS[part]]


def observed_actions(every_s, action=lambda step: step):
    """Return the last action in each observation, where step n's action is ``action(n)``."""
    legs = Legs(every_s=every_s)
    for step in range(12):
        legs.step(np.full(19, action(step) * 1e-3))
    return 1e3 * legs.seen("last action")[:, 0]


def test_the_observed_last_action_is_that_of_20_ms_before():
    assert observed_actions(0.005)[7:] == pytest.approx([3, 4, 5, 6, 7])


def test_the_observed_last_action_is_a_mean_and_not_a_sample_every_20_ms():
    swapping = observed_actions(0.005, lambda step: 7 if step % 4 else -7)
    assert np.abs(swapping[7:] - 3.5).max() < 1.6


def test_the_mean_of_the_last_actions_equals_numpys_bit_for_bit():
    """Runs then equal earlier ones, which took NumPy's mean."""
    actions = np.random.RandomState(0).uniform(-1, 1, (40, 19))
    legs = Legs()
    for action in actions:
        legs.step(action)
    seen = legs.seen("last action")
    for step in range(7, len(actions)):
        assert seen[step].tolist() == actions[step - 7 : step].mean(axis=0).tolist()


def test_an_observation_is_held_until_the_next():
    assert observed_actions(0.02) == pytest.approx([0, 0, 0, 0, 0, 0, 0, 0, 4, 4, 4, 4])


def test_the_command_and_the_pose_are_observed():
    legs = Legs()
    shown = legs.step(np.zeros(19), (0.004, -0.003))
    assert shown[PARTS["command"]].tolist() == [0.004, 0.0, -0.003]
    angles = legs.plant.data.qpos[7:] - POSE_RAD
    assert shown[PARTS["joint angles"]] == pytest.approx(angles)


@pytest.mark.parametrize("every_s", [0.005, 0.02])
def test_commands_change_no_faster_than_in_training(every_s):
    legs = Legs(every_s=every_s)
    for command, observed in (((0.5, -0.3), (0.1, 0, -0.2)), ((0.0, 0.0), (0, 0, 0))):
        for _ in range(20):
            shown = legs.step(np.zeros(19), command)
        assert shown[PARTS["command"]] == pytest.approx(observed)


def test_values_out_of_range_are_clipped_for_the_policy_alone():
    legs = Legs(Box(np.zeros(69), np.full(69, 1e-4)))
    shown = legs.step(np.zeros(19), (0.4, -0.3))
    assert shown[PARTS["command"]] == pytest.approx([1e-4, 0.0, -1e-4])
    assert legs.port.observed[PARTS["command"]].tolist() == [0.005, 0.0, -0.01]


def test_a_second_run_is_like_the_first():
    legs = Legs()
    first = [legs.step(np.full(19, 0.1), (0.5, 0.2)).tolist() for _ in range(5)]
    legs.plant.reset(0)
    legs.loop.begin()
    again = [legs.step(np.full(19, 0.1), (0.5, 0.2)).tolist() for _ in range(5)]
    assert again == first


def test_an_action_that_is_not_finite_is_refused():
    with pytest.raises(DivergedError, match=r"not finite at 0\.000 s.*cure"):
        Legs().step(np.full(19, np.nan))


def test_a_run_is_over_when_the_robot_fell():
    legs = Legs()
    while not legs.loop.over:
        legs.step(np.full(19, 2.0))
    assert legs.port.fallen_at_s == pytest.approx(legs.plant.time_s)
