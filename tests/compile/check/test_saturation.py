"""Hints on neurons on the chip that would have to spike several times in a step."""

from typing import Any

import nengo
import numpy as np
import pytest
from nengo_loihi.neurons import LoihiSpikingRectifiedLinear

import spikeport
from spikeport.compile.pipeline import compile_network
from spikeport.networks.action_selection import (
    SelectionOptions,
    action_selection,
    gate_neurons,
)
from spikeport.networks.gating import full_rate_ensemble, gate
from spikeport.neurons import IntegrateAndFire

RECTIFIED = nengo.SpikingRectifiedLinear()


def driven(read: bool = True, value: float = 0.9, **options: Any) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(20, 1, label="a", **{"neuron_type": RECTIFIED, **options})
        nengo.Connection(nengo.Node([value]), a, synapse=None)
        if read:
            nengo.Connection(a, nengo.Ensemble(20, 1, label="b"))
        network.p = nengo.Probe(a.neurons)
    return network


def hints(network: nengo.Network, dt_s: float = 0.001, pipeline: str = "as_written") -> list[str]:
    found = compile_network(network, dt=dt_s, pipeline=pipeline).report.hints
    return [str(hint) for hint in found if hint.id == "SP424"]


def at(rate_hz: float) -> dict[str, np.ndarray]:
    return {"max_rates": np.full(20, rate_hz)}


def by_gain(gain: float, bias: float = 0.0) -> dict[str, np.ndarray]:
    return {"gain": np.full(20, gain), "bias": np.full(20, bias), "encoders": np.ones((20, 1))}


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_rates_above_a_spike_per_step_get_a_hint(pipeline: str) -> None:
    network = driven(**at(3000))
    assert hints(network, pipeline=pipeline) == [
        "a: SP424 more than one spike in a step: up to 3,000 Hz, in 20 of 20 neurons, limit "
        "1,000 Hz; cure: lower the maximum rates, or gains and biases, or, from Python, "
        "take a shorter dt: Simulator(network, dt=0.0005)"
    ]


@pytest.mark.parametrize(
    "kind",
    [RECTIFIED, nengo.LIF(tau_ref=1e-4), nengo.RegularSpiking(nengo.RectifiedLinear())],
    ids=repr,
)
def test_the_limit_is_a_spike_per_step(kind: nengo.neurons.NeuronType) -> None:
    for rate_hz, dt_s, found in ((1000, 0.001, 0), (1100, 0.001, 1), (1100, 0.0005, 0)):
        assert len(hints(driven(neuron_type=kind, **at(rate_hz)), dt_s)) == found


def test_the_amplitude_of_spikes_does_not_count() -> None:
    assert hints(driven(neuron_type=nengo.LIF(amplitude=5.0))) == []


def test_gains_and_biases_count_within_the_values_that_are_decoded() -> None:
    assert len(hints(driven(**by_gain(3000)))) == 1
    assert hints(driven(**by_gain(3000), eval_points=[[0.1], [0.3]])) == []
    assert len(hints(driven(**by_gain(3000), eval_points=[[0.1], [0.5]]))) == 1
    # Neurons that nobody decodes may have any input.
    assert hints(driven(read=False, **by_gain(3000, 3000))) == []


def test_points_of_many_dimensions_count_by_their_norm() -> None:
    rates, points = {"max_rates": np.full(40, 800.0)}, np.vstack([np.eye(16), -np.eye(16)])
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(40, 16, neuron_type=RECTIFIED, eval_points=points, **rates)
        nengo.Connection(a, nengo.Ensemble(20, 16))
    assert hints(network) == []


@pytest.mark.parametrize("bias_hz", [300, 3000])
def test_neurons_without_input_fire_at_the_rate_of_their_bias(bias_hz: float) -> None:
    with nengo.Network(seed=1) as network:
        nengo.Probe(nengo.Ensemble(20, 1, neuron_type=RECTIFIED, **by_gain(5000, bias_hz)).neurons)
    assert len(hints(network)) == (bias_hz > 1000)


def test_switches_that_are_decoded_at_one_point_get_none() -> None:
    assert hints(driven(**by_gain(10, 3000), eval_points=[[0.0]])) == []


def test_evaluation_points_of_a_connection_are_in_units_of_the_radius_or_not() -> None:
    for scaled, n_hints in ((True, 1), (False, 0)):
        network = driven(read=False, radius=4.0, **by_gain(3000))
        with network:
            points = {"eval_points": [[0.0], [1.0]], "scale_eval_points": scaled}
            nengo.Connection(network.all_ensembles[0], nengo.Ensemble(20, 1), **points)
        assert len(hints(network)) == n_hints


def test_neurons_that_spike_once_in_a_step_in_float_too_get_none() -> None:
    kind = IntegrateAndFire(threshold=1.0)
    assert hints(driven(neuron_type=kind, **by_gain(0, 1e5))) == []


@pytest.mark.parametrize(("amplitude", "rate_hz", "hinted"), [(2.0, 1500, True), (0.4, 600, False)])
def test_the_height_of_a_spike_is_not_its_rate(
    amplitude: float, rate_hz: float, hinted: bool
) -> None:
    for kind in (
        nengo.SpikingRectifiedLinear(amplitude=amplitude),
        nengo.RegularSpiking(nengo.RectifiedLinear(), amplitude=amplitude),
    ):
        assert bool(hints(driven(neuron_type=kind, **by_gain(rate_hz)))) == hinted


def test_nengo_loihis_own_neurons_saturate_in_float_too() -> None:
    kind = LoihiSpikingRectifiedLinear()
    assert hints(driven(neuron_type=kind, **by_gain(1200)), dt_s=0.002) == []


def test_basal_ganglia_whose_gates_fire_in_every_step_get_none() -> None:
    assert hints(action_selection(3)) == []
    with nengo.Network(seed=1) as network:
        utilities = nengo.Node(size_in=3)
        gates, neurons = gate_neurons(3, SelectionOptions(), seed=0)
        nengo.Connection(utilities, gates)
        follower = nengo.Ensemble(20, 1)
        gate(neurons[0], [follower])
        gate(full_rate_ensemble("closed", always=True).neurons, [follower])
    assert hints(network) == []


def test_neurons_saturate_on_the_chip_where_a_hint_warns_of_it() -> None:
    shares = {}
    for rate_hz in (200, 3000):
        network, rates = driven(read=False, **at(rate_hz)), []
        for backend in ("reference", "native"):
            with spikeport.Simulator(network, backend=backend, progress_bar=False) as sim:
                sim.run(0.2)
            rates.append(sim.data[network.p].mean())
        shares[rate_hz] = rates[1] / rates[0]
    assert shares[200] > 0.8
    assert shares[3000] < 0.5
