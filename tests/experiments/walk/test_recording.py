"""The record of a walk, and the values computed from its series."""

import numpy as np
import pytest

from spikeport.experiments.walk.recording import WalkRecording, WalkRun, dataset, fallen

N = 3
SIZES = {"observation": 69, "reference": 4, "state": 5, "action": 19, "command": 2}
SIZES |= {"quaternion": 4, "turning_rad_s": 3}


def recorded(**given):
    """Return the record of a robot that stands still; arguments replace its series."""
    series = {name: np.zeros((N, size)) for name, size in SIZES.items()}
    series |= {"height_m": np.ones(N), "on_floor": np.ones((N, 2), dtype=bool)}
    return WalkRecording(0.005 * np.arange(N), **{**series, **given})


@pytest.mark.parametrize(
    ("height_m", "tilt_rad", "down"),
    [(1.0, 0.0, False), (0.71, 0.0, False), (0.69, 0.0, True), (1.0, 0.78, False), (1, 0.79, True)],
)
def test_a_robot_has_fallen_when_it_is_low_or_tilted(height_m, tilt_rad, down):
    assert fallen(height_m, np.cos(tilt_rad)) == down


def test_speed_is_that_along_the_heading():
    state = np.zeros((N, 5))
    state[:, 0] = 0, np.pi / 2, np.pi
    state[:, 1:3] = [[1, 2], [3, 4], [5, 6]]
    state[:, 3:] = 0.5, 0.2
    recording = recorded(state=state)
    assert recording.speed_m_s == pytest.approx([0.5, 0.2, -0.5])
    assert recording.position_m.tolist() == [[1, 2], [3, 4], [5, 6]]


@pytest.mark.parametrize(("n", "way_m"), [(301, 0.45), (281, 0.42), (51, 0.075)])
def test_the_walked_way_is_measured_every_half_second_and_at_the_end(n, way_m):
    state = np.zeros((n, 5))
    state[:, 1] = 0.3 * 0.005 * np.arange(n)
    state[:, 2] = 0.1 * (np.arange(n) % 100 == 40)  # sway between half seconds
    series = {name: np.zeros((n, size)) for name, size in SIZES.items()}
    walked = WalkRecording(
        0.005 * np.arange(n),
        **{**series, "state": state, "height_m": np.ones(n), "on_floor": np.ones((n, 2), bool)},
    )
    assert walked.walked_m == pytest.approx(way_m)
    assert recorded().walked_m == 0


def test_the_yaw_rate_is_about_the_vertical_of_a_tilted_robot():
    # Upright, with the nose down by a right angle, and with the right side down by asin(0.6).
    turned = np.sqrt([[1, 0, 0, 0], [0.5, 0, 0.5, 0], [0.9, 0.1, 0, 0]])
    rates = recorded(
        quaternion=turned, turning_rad_s=np.tile([0.1, 0.5, 1.0], (N, 1))
    ).yaw_rate_rad_s
    assert rates == pytest.approx([1.0, -0.1, 0.6 * 0.5 + 0.8 * 1.0])


def test_a_spike_has_its_time_and_neuron():
    spikes = np.zeros((5, 4), dtype=bool)
    spikes[0, 2] = spikes[3, 1] = True
    made = dataset(WalkRun(None, 1.0, recorded(), None, None, None, 1.0, spikes))
    assert made.policy_time.values == pytest.approx([0.001, 0.004])
    assert made.policy_neuron.values.tolist() == [2, 1]
    silent = dataset(WalkRun(None, 1.0, recorded(), None, None, None, 1.0))
    assert "policy_time" not in silent
    assert silent.sizes["observed"] == 69
