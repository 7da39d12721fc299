"""Recorded gaits: the trim of a policy, and the ranges of its observations."""

import numpy as np
import pytest

from spikeport.experiments.policy.settings import GAITS
from spikeport.experiments.walk.gait import (
    COMMANDS,
    NARROWEST,
    SIDEWAYS,
    clipped_shares,
    drift_trim,
    encoding,
    record_gait,
)
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.networks.region import Box
from spikeport.robot.walk_interface import PARTS
from spikeport.training.commands import CommandRange

PUSHED_M_S = 0.05


@pytest.mark.slow
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


@pytest.mark.slow
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


def test_a_robot_that_fell_stands_up_again_each_time_in_another_pose():
    hips_back = 1.0 * np.isin(np.arange(19), [2, 7])
    observed = record_gait(lambda _observation: hips_back, seconds=4.0)[:800]
    upright = -observed[:, PARTS["gravity"]][:, 2]
    # No robot turns its pelvis by so much within 5 ms.
    stood_up = 1 + np.flatnonzero(np.diff(upright) > 0.2)
    assert len(stood_up) > 1
    np.testing.assert_allclose(upright[stood_up], 1, atol=0.01)
    angles = observed[stood_up, PARTS["joint angles"]]
    assert len(np.unique(angles, axis=0)) == len(stood_up)


def test_commands_have_the_range_of_training_whatever_was_recorded():
    trained = CommandRange()
    assert (trained.vx_m_s, (-trained.wz_rad_s, trained.wz_rad_s)) == COMMANDS
    box, command = encoding(np.full((2, 69), 7.0)), PARTS["command"]
    # Forward speeds from 0 to 1 m/s, no sideways speed, and yaw rates from -1 to 1 rad/s.
    assert box.centre[command].tolist() == [0.5, 0.0, 0.0]
    assert box.half[command].tolist() == [0.5, NARROWEST, 1.0]


def test_values_beyond_either_end_of_the_range_count_as_clipped():
    observations = np.full((4, 69), 2.0)
    observations[:2, PARTS["gravity"]] = [[3.1], [0.9]]
    shares = clipped_shares(observations, Box(np.full(69, 2.0), np.ones(69)))
    assert shares == {name: 0.5 if name == "gravity" else 0.0 for name in PARTS}
