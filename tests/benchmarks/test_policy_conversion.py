"""The errors of converted policies that the benchmark measures."""

import numpy as np
import pytest
from policy_conversion import errors

from spikeport.networks.policy import Readout

WANTED = np.sin(0.3 * np.arange(200))[:, np.newaxis] * [1.0, 2.0]


def test_an_action_that_is_only_late_has_no_error_but_a_lag() -> None:
    late = np.roll(WANTED, 3, axis=0)
    found = errors("solved", Readout(np.eye(2), np.zeros(2)), late, WANTED)
    assert found["solved"] == pytest.approx(0, abs=1e-12)
    assert found["solved_lag_s"] == pytest.approx(0.015)


def test_an_error_is_relative_to_the_variation_of_the_actions() -> None:
    shifted = Readout(np.eye(2), np.array([0.1, -0.1]))
    found = errors("solved", shifted, WANTED, WANTED)
    assert found["solved"] == pytest.approx(0.1 / np.sqrt(2.5 / 2), rel=0.02)
    assert found["solved_lag_s"] == 0
