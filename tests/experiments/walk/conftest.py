"""Walks that are prepared in little time."""

import pytest

from spikeport.experiments.walk import calibration, controller, run
from spikeport.experiments.walk.gait import record_gait


@pytest.fixture
def short_gait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ranges and calibrations from one second of gait."""
    for module in (calibration, controller, run):
        monkeypatch.setattr(module, "record_gait", lambda policy: record_gait(policy, 1.0))
