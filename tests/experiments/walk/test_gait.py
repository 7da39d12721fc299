"""Recorded gaits: the trim of a policy, and the ranges of its observations."""

import numpy as np
import pytest

from spikeport.experiments.policy.settings import GAITS
from spikeport.experiments.walk.gait import (
    SIDEWAYS,
    clipped_shares,
    drift_trim,
    encoding,
    record_gait,
)
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.networks.region import Box
from spikeport.robot.walk_interface import PARTS

PUSHED_M_S = 0.05


def test_the_trim_removes_the_drift_of_a_policy():
    exact = WalkSettings().walking_policy()

    def drifting(observation):
        """Return the action of a policy that observes itself moving to the right."""
        seen = observation.copy()
        seen[SIDEWAYS] -= PUSHED_M_S
        return exact(seen)

    trim = drift_trim(drifting)
    assert np.flatnonzero(trim).tolist() == [SIDEWAYS]
    assert trim[SIDEWAYS] == pytest.approx(PUSHED_M_S, rel=0.1)  # its own drift is 0.005 m/s
    left = drift_trim(lambda observation: drifting(observation + trim))
    assert abs(left[SIDEWAYS]) < 0.1 * PUSHED_M_S


def test_a_rough_gait_has_wider_ranges_of_velocity_and_tilt_than_a_calm_one():
    exact = WalkSettings().walking_policy()
    calm, rough = (encoding(record_gait(exact, GAITS[name], 8.0)) for name in ("calm", "rough"))
    for place in (SIDEWAYS, PARTS["gravity"].start):
        assert rough.half[place] > 2 * calm.half[place]


def test_a_gait_is_recorded_under_each_perturbation_in_turn():
    exact = WalkSettings().walking_policy()
    pushed, sloping = (record_gait(exact, (one,), 1.0)[:200] for one in GAITS["rough"])
    both = record_gait(exact, GAITS["rough"], 1.0)
    assert both.shape == (800, 69)
    np.testing.assert_array_equal(both[:200], pushed)
    assert not np.array_equal(both[200:400], sloping)  # its commands are drawn after the others


def test_values_beyond_either_end_of_the_range_count_as_clipped():
    observations = np.zeros((4, 69))
    observations[:2, PARTS["gravity"]] = [[1.1], [-1.1]]
    shares = clipped_shares(observations, Box(np.zeros(69), np.ones(69)))
    assert shares == {name: 0.5 if name == "gravity" else 0.0 for name in PARTS}
