"""Errors of firing rates whose intervals are rounded to whole steps."""

import nengo
import numpy as np
import pytest

from spikeport.compile.loihi.aliasing import rate_aliasing
from spikeport.compile.pipeline import compile_network
from tests.helpers.chip_networks import integer_blocks


def neuron(label: str, rate_hz: float) -> nengo.Ensemble:
    """Return a neuron that fires at one rate, whatever it represents."""
    relu = nengo.SpikingRectifiedLinear()
    return nengo.Ensemble(1, 1, neuron_type=relu, gain=[1e-9], bias=[rate_hz], label=label)


def test_an_interval_is_rounded_up_to_whole_steps() -> None:
    with nengo.Network(seed=1) as network:
        neuron("fast", 300.0)  # 3.33 steps, which the chip makes 4: 250 Hz
        neuron("slow", 260.0)  # 3.85 steps
        neuron("silent", 0.0)
    found = rate_aliasing(integer_blocks(network).floats)
    assert found == pytest.approx({"fast": 50 / 300, "slow": 10 / 260, "silent": 0}, rel=1e-6)


def test_an_ensemble_that_is_cut_has_the_error_of_all_its_neurons() -> None:
    with nengo.Network(seed=1) as network:
        rates = np.repeat([450.0, 60.0], 100)
        relu = nengo.SpikingRectifiedLinear()
        nengo.Ensemble(200, 1, neuron_type=relu, gain=np.full(200, 1e-9), bias=rates, label="a")
    whole = rate_aliasing(compile_network(network, pipeline="").blocks.floats)
    cut = rate_aliasing(
        compile_network(network, pipeline="split_ensembles{max_neurons=100}").blocks.floats
    )
    assert cut == pytest.approx(whole)
    assert whole["a"] > 0.1


def test_faster_neurons_have_larger_errors_of_rate() -> None:
    with nengo.Network(seed=1) as network:
        for rate in (20, 200):
            nengo.Ensemble(20, 1, max_rates=nengo.dists.Choice([rate]), label=f"{rate}")
    found = rate_aliasing(integer_blocks(network).floats)
    assert 0 < found["20"] < found["200"]
    assert np.isfinite(list(found.values())).all()


def test_the_amplitude_of_spikes_does_not_change_the_error_of_rate() -> None:
    kinds = {
        "regular": nengo.RegularSpiking(nengo.RectifiedLinear(), amplitude=2),
        "plain": nengo.SpikingRectifiedLinear(amplitude=2),
    }
    with nengo.Network(seed=1) as network:
        for label, kind in kinds.items():
            nengo.Ensemble(1, 1, neuron_type=kind, gain=[1e-9], bias=[300.0], label=label)
    found = rate_aliasing(integer_blocks(network).floats)
    assert found == pytest.approx(dict.fromkeys(kinds, 50 / 300), rel=1e-6)
