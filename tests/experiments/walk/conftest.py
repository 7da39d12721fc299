"""Walks that are prepared in little time."""

import pytest

from spikeport.experiments.policy.calibration import Walks
from spikeport.experiments.walk import gait, trial
from spikeport.experiments.walk.gait import record_gait


@pytest.fixture
def short_gait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ranges and calibrations from seconds of gait."""

    def short(policy):
        return record_gait(policy, 1.0)

    monkeypatch.setattr(trial, "record_gait", short)
    monkeypatch.setattr(trial, "WALKS", Walks(short, gait.drift_trim))
    monkeypatch.setattr(gait, "STRAIGHT_S", 2.5)
