"""Random commands of an episode."""

import numpy as np

from spikeport.experiments.evaluate.commands import HELD_S, RandomCommands
from spikeport.experiments.walk.gait import COMMANDS


def test_the_same_seed_draws_the_same_commands():
    one, same, other = (RandomCommands(60.0, seed) for seed in (3, 3, 4))
    times_s = np.arange(0, 60, 0.5)
    np.testing.assert_array_equal([one.at(t) for t in times_s], [same.at(t) for t in times_s])
    assert any((one.at(t) != other.at(t)).any() for t in times_s)


def test_commands_are_held_and_within_the_range_that_policies_are_trained_for():
    commands = RandomCommands(2000.0, 0)
    times_s = np.arange(0, 2000, 0.1)
    drawn = np.array([commands.at(t) for t in times_s])
    for values, (low, high) in zip(drawn.T, COMMANDS, strict=True):
        assert low <= values.min() < values.max() <= high
    jumps_s = times_s[1:][(drawn[1:] != drawn[:-1]).any(axis=1)]
    assert HELD_S[0] - 0.2 <= np.diff(jumps_s).min()
    standing = ~drawn.any(axis=1)
    turning = (drawn[:, 0] == 0) & ~standing
    assert 0.05 < standing.mean() < 0.15
    assert 0.05 < turning.mean() < 0.15


def test_the_age_of_a_command_counts_from_its_jump():
    commands = RandomCommands(30.0, 1)
    age_s = commands.age_s(np.array([0.0, 1.0, 2.9]))
    np.testing.assert_allclose(age_s, [0.0, 1.0, 2.9])
    assert commands.age_s(np.array([29.0]))[0] <= HELD_S[1]
