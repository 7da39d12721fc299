"""Hints on neurons on the host that spike several times in a step."""

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.compile.check.host_neurons import host_neuron_hints
from tests.helpers.small_networks import scope_of

RECTIFIED = nengo.RectifiedLinear()


def fed(kind: nengo.neurons.NeuronType, rate_hz: float, by_bias: bool = True) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        driven = {"gain": np.ones(4), "bias": np.full(4, rate_hz - 1)}
        rates = driven if by_bias else {"max_rates": np.full(4, rate_hz)}
        a = nengo.Ensemble(4, 1, label="a", neuron_type=kind, **rates)
        of_chip = {"neuron_type": nengo.SpikingRectifiedLinear(), "gain": np.ones(4)}
        b = nengo.Ensemble(4, 1, label="b", bias=np.zeros(4), **of_chip)
        network.config[a].on_chip = False
        nengo.Connection(a.neurons, b.neurons, transform=0.1)
        network.p = nengo.Probe(b.neurons)
    return network


def hints(network: nengo.Network, dt_s: float = 0.001) -> list[tuple[str, str, str]]:
    found = host_neuron_hints(scope_of(network), dt_s)
    return [(one.object, one.used, one.limit) for one in found]


@pytest.mark.parametrize("by_bias", [False, True])
@pytest.mark.parametrize(
    ("kind", "limit_hz"),
    [
        (nengo.SpikingRectifiedLinear(amplitude=2), 1000),
        (nengo.RegularSpiking(RECTIFIED, amplitude=2), 1000),
        (nengo.StochasticSpiking(RECTIFIED), 1000),
        (nengo.PoissonSpiking(RECTIFIED), 100),
    ],
    ids=repr,
)
def test_rates_above_the_limit_of_a_neuron_type_get_a_hint(
    kind: nengo.neurons.NeuronType, limit_hz: float, by_bias: bool
) -> None:
    assert hints(fed(kind, limit_hz, by_bias)) == []
    more = fed(kind, 1.5 * limit_hz, by_bias)
    assert hints(more) == [("a -> b", f"up to {1.5 * limit_hz:,.0f} Hz", f"{limit_hz:,} Hz")]
    assert hints(more, dt_s=0.0005) == []


def test_neurons_that_spike_at_most_once_in_a_step_get_no_hint() -> None:
    assert hints(fed(nengo.LIF(tau_ref=0), 5000)) == []


def test_spikes_are_lost_on_the_chip_where_a_hint_warns_of_it() -> None:
    sums = {}
    for rate_hz in (900, 2500):
        network = fed(nengo.SpikingRectifiedLinear(), rate_hz)
        with nengo.Simulator(network, progress_bar=False) as floats:
            floats.run(0.5)
        with spikeport.Simulator(network, progress_bar=False) as sim:
            sim.run(0.5)
        sums[rate_hz] = sim.data[network.p].sum() / floats.data[network.p].sum()
        found = [one["id"] for one in sim.report()["hints"]]
        assert ("SP417" in found) == (rate_hz > 1000)
    assert sums[900] > 0.9
    assert sums[2500] < 0.5
