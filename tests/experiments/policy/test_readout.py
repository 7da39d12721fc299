"""Whether a trial's policy is calibrated."""

from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.experiments.policy import readout as module
from spikeport.experiments.policy.calibration import Walks
from spikeport.experiments.policy.readout import calibrated

REFITTED = {"weights": np.ones((2, 4)), "bias": np.zeros(2), "trim": np.zeros(69)}
WALKS = Walks(lambda _policy: np.zeros((1, 69)), lambda _policy: np.zeros(69))


@pytest.mark.parametrize(
    ("backend", "given", "refits"),
    [
        ("native", "auto", True),
        ("nengo-loihi", "auto", True),
        ("reference", "auto", False),
        ("reference", True, True),
        ("native", False, False),
    ],
)
def test_auto_refits_on_a_chip_alone(monkeypatch, backend, given, refits):
    monkeypatch.setattr(module, "refitted", lambda *_: SimpleNamespace(decoders=REFITTED))
    settings, options = SimpleNamespace(calibrated=given), SimpleNamespace(backend=backend)
    trial = SimpleNamespace(settings=settings, options=options)
    found = calibrated(trial, [], [], np.zeros((1, 69)), WALKS)
    assert (found is not None) is refits
