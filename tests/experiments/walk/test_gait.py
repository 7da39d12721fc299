"""The trim of a policy by its gait."""

import numpy as np
import pytest

from spikeport.experiments.walk.gait import SIDEWAYS, drift_trim, encoding, record_gait
from spikeport.experiments.walk.settings import WalkSettings

PUSHED_M_S = 0.05


def test_a_trim_takes_the_drift_away():
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


def test_a_pushed_gait_has_sideways_velocities_that_an_undisturbed_one_has_not():
    exact = WalkSettings().walking_policy()
    undisturbed, pushed = (encoding(record_gait(exact, push, 8.0)) for push in (0.0, 0.8))
    assert pushed.half[SIDEWAYS] > 2 * undisturbed.half[SIDEWAYS]
