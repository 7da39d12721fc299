"""The choice of a trial's calibration: none, refitted, or from a file."""

from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.cache import NOTHING, Cache
from spikeport.errors import UsageError
from spikeport.experiments.calibration import Refitted
from spikeport.experiments.options import Options
from spikeport.experiments.policy import readout as module
from spikeport.experiments.policy.calibration import METHOD, Walks
from spikeport.experiments.policy.readout import calibrated, check_neurons, refitted
from spikeport.networks.policy import Layer, PolicyOptions

LAYERS = [Layer(np.ones((2, 69)), np.zeros(2))]
GAIT = np.zeros((1, 69))
WALKS = Walks(lambda _policy: GAIT, lambda _policy: np.zeros(69))


@pytest.fixture(autouse=True)
def found(monkeypatch):
    """Replace the calibration by one that finds fixed decoders, and return these."""
    decoders = {"weights": np.ones((2, 2 * 69)), "bias": np.zeros(2), "trim": np.ones(69)}
    monkeypatch.setattr(module, "calibrated_policy", lambda *_: Refitted(decoders, ""))
    return decoders


def trial(given, backend="native", cache=NOTHING, policy="spiking"):
    settings = SimpleNamespace(
        calibrated=given,
        conversion={},
        network_seed=0,
        policy_options=PolicyOptions(),
        policy=policy,
    )
    options = Options(1.0, backend=backend, cache=cache)
    return SimpleNamespace(settings=settings, options=options, recorded={})


def asked(given, backend="native"):
    return calibrated(trial(given, backend), LAYERS, [], GAIT, WALKS)


@pytest.mark.parametrize(
    ("backend", "given", "fits"),
    [
        ("native", "auto", True),
        ("nengo-loihi", "auto", True),
        ("reference", "auto", False),
        ("reference", True, True),
        ("native", False, False),
    ],
)
def test_auto_calibrates_only_on_backends_with_a_chip(backend, given, fits):
    assert (asked(given, backend) is not None) is fits


@pytest.mark.parametrize(("given", "text"), [("c.npz", "c.npz"), (True, "true")])
def test_a_calibration_is_refused_where_there_are_no_neurons(given, text):
    check_neurons(trial(given, "native"))
    check_neurons(trial("auto", "analytic"))
    with pytest.raises(UsageError) as caught:
        check_neurons(trial(given, "analytic"))
    assert str(caught.value) == (
        f"calibrated={text}: backend 'analytic' has no neurons to calibrate; leave it out, or give "
        "--backend native"
    )


def test_the_exact_policy_is_not_calibrated():
    check_neurons(trial("auto", policy="mlp"))
    with pytest.raises(UsageError) as caught:
        check_neurons(trial(True, policy="mlp"))
    assert str(caught.value) == (
        "calibrated=true: policy=mlp has no neurons to calibrate; leave it out, or give "
        "--set policy=spiking"
    )


def test_a_file_gives_the_saved_decoders_unless_another_method_made_them(
    tmp_path, monkeypatch, found
):
    file = tmp_path / "c.npz"
    refitted(trial(True), LAYERS, [], GAIT, WALKS).save(file)
    kept = asked(str(file))
    assert all((getattr(kept, name) == value).all() for name, value in found.items())
    monkeypatch.setattr(module, "METHOD", METHOD + 1)
    message = f"made for method={METHOD}, but the run has method={METHOD + 1}"
    with pytest.raises(UsageError, match=message):
        asked(str(file))


@pytest.mark.parametrize("changed", ["nothing", "policy", "gait", "network_seed"])
def test_a_cached_calibration_is_used_again_only_for_equal_inputs(
    tmp_path, monkeypatch, found, changed
):
    kept = trial(True, cache=Cache(tmp_path / "cache"))
    first = refitted(kept, LAYERS, [], GAIT, WALKS)
    monkeypatch.setattr(module, "calibrated_policy", lambda *_: Refitted({"weights": GAIT}, "new"))
    layers = [Layer(2 * np.ones((2, 69)), np.zeros(2))] if changed == "policy" else LAYERS
    gait = GAIT + 1 if changed == "gait" else GAIT
    kept.settings.network_seed = int(changed == "network_seed")
    again = refitted(kept, layers, [], gait, WALKS)
    assert first.decoders.keys() == found.keys()
    assert (again.image_digest == "new") is (changed != "nothing")
    if changed == "nothing":
        assert (again.made_for, again.image_digest) == (first.made_for, first.image_digest)
        assert all((again.decoders[name] == value).all() for name, value in found.items())
