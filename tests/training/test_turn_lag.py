"""The gains of a policy whose course is behind its heading."""

import re

import numpy as np
import pytest

pytest.importorskip("torch")

from spikeport.experiments.policy import settings
from spikeport.networks.walking_policy import load
from spikeport.training import turn_lag
from spikeport.training.turn_lag import KP_SPEED, with_gains

RATES = np.linspace(-1, 1, 16)


def moving(monkeypatch, lag_s, speed_m_s=0.5):
    """Let robots move in the direction that they were heading ``lag_s`` before."""
    course = speed_m_s * np.stack((np.cos(lag_s * RATES), -np.sin(lag_s * RATES)), axis=1)
    monkeypatch.setattr(turn_lag, "turning", lambda _policy: (course, RATES))


@pytest.mark.parametrize(
    ("lag_s", "allowed_s", "kp_heading"),
    [(0.06, 0.1, 1 / (0.5 / KP_SPEED - 0.1)), (-0.1, 0.0, 2 * KP_SPEED)],
)
def test_gains_allow_for_the_lag(monkeypatch, lag_s, allowed_s, kp_heading):
    moving(monkeypatch, lag_s)
    policy, turn_lag_s = with_gains(load())
    found = policy.gains
    assert turn_lag_s == pytest.approx(allowed_s)
    assert (found.kp_speed, found.kp_heading) == (KP_SPEED, pytest.approx(kp_heading))


def test_the_gain_for_a_very_long_lag_is_limited(monkeypatch):
    moving(monkeypatch, 0.6)
    assert with_gains(load()).policy.gains.kp_heading == pytest.approx(4.89, abs=0.01)


def test_a_policy_that_hardly_walks_keeps_its_gains(monkeypatch):
    moving(monkeypatch, 0.1, speed_m_s=0.1)
    policy = load()
    assert with_gains(policy) == (policy, None)


def test_the_program_of_the_walks_page_writes_a_policy_with_gains_of_its_own(
    monkeypatch, root, tmp_path
):
    moving(monkeypatch, 0.06)
    page = (root / "docs" / "walk.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    monkeypatch.setattr(settings, "load_policy", lambda *_files: load())
    monkeypatch.chdir(tmp_path)
    exec(program, {})
    assert load(tmp_path / "policy.npz").gains == with_gains(load()).policy.gains


@pytest.mark.slow
def test_the_shipped_policy_lags_little():
    velocity, yaw_rate = turn_lag.turning(load())
    behind = -np.arctan2(velocity[:, 1], velocity[:, 0])
    assert np.polyfit(yaw_rate, behind, 1)[0] == pytest.approx(0.02, abs=0.015)
