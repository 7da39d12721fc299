"""Errors of direct wiring, before there are any blocks, against those of blocks."""

import warnings
from collections.abc import Callable

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.compile.ground.quantisation import block_values, restored_block
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.passes.decode_path import DecodePath
from spikeport.compile.passes.scale_rows import ScaleRows
from spikeport.compile.pipeline import compile_network
from spikeport.compile.rewriting.direct_errors import DirectErrors
from spikeport.compile.rewriting.links import link
from tests.helpers.random_networks import rewritten
from tests.helpers.same_run import context
from tests.helpers.small_networks import DT_S, rewrite_of, scope_of

N = 100


def pair(transform: float, tau: float, n_host: int = 0) -> nengo.Network:
    """Return an ensemble that is wired directly to another, which the host may send values, too."""
    with nengo.Network(seed=3, label="pair") as network:
        spikeport.add_params(network)
        a, b = nengo.Ensemble(N, 1, label="a"), nengo.Ensemble(N, 1, label="b")
        wired = nengo.Connection(a, b, transform=transform, synapse=tau)
        network.config[wired].decode_path = "direct"
        for _ in range(n_host):
            nengo.Connection(nengo.Node([0.5]), b, synapse=None)
    return network


def measured(network: nengo.Network) -> float:
    """Return the relative error of the decoders that the rounded weights of "b" stand for."""
    rewrite, _ = rewritten(network, DecodePath())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        floats = ScaleRows().apply(build(rewrite, DT_S), context())
        after = discretise(floats).blocks[1]
    before = floats.blocks[1]
    # The group of the host, if any, comes after that of the neurons, or before it.
    (group,) = [i for i, s in enumerate(before.synapses) if s.label == "neuron_weights"]
    wanted, found = (
        values.weights[group].reshape(-1, N)
        for values in (block_values(before), restored_block(block_values(before), after))
    )
    built = ParameterSolver(rewrite_of(network), DT_S).ensemble(network.ensembles[1])
    # Both rows and thresholds were scaled: a row of a neuron counts in units of its threshold.
    units = built.gain * before.compartment.vth
    decoders = [np.linalg.lstsq(built.encoders, (w / units).T)[0] for w in (wanted, found)]
    return float(np.linalg.norm(decoders[1] - decoders[0]) / np.linalg.norm(decoders[0]))


def estimated(network: nengo.Network, profiles: int = 3) -> float:
    (wired,) = [c for c in network.connections if c.pre_obj is network.ensembles[0]]
    solver = ParameterSolver(rewrite_of(network), DT_S)
    links = {wired: link(wired, solver)}
    errors = DirectErrors(links, scope_of(network), solver, profiles, in_axons=4096)
    return errors.of(wired, links, wired.synapse.tau)


@pytest.mark.parametrize("transform", [1.0, 0.3, 0.1])
@pytest.mark.parametrize("tau", [0.05, 0.1, 0.2])
def test_the_estimate_is_within_a_factor_of_2_of_the_loss_to_rounding(
    transform: float, tau: float
) -> None:
    network = pair(transform, tau)
    assert measured(network) / 2 < estimated(network) < measured(network) * 2


def test_values_from_the_host_coarsen_the_weights_beside_them() -> None:
    alone, beside = pair(1.0, 0.01), pair(1.0, 0.01, n_host=1)
    assert estimated(beside) > 2 * estimated(alone)
    assert measured(beside) / 2 < estimated(beside) < measured(beside) * 2


def test_weights_that_all_become_zero_are_lost_as_a_whole() -> None:
    assert estimated(pair(1e-3, 0.1)) == pytest.approx(1, rel=0.1)


def test_a_link_that_sends_nothing_loses_nothing() -> None:
    assert estimated(pair(0.0, 0.1)) < 1e-3


def test_a_filter_that_the_chip_does_not_have_loses_all() -> None:
    assert estimated(pair(1.0, 100.0)) == 1


def test_scaled_rows_lose_less() -> None:
    network = pair(1.0, 0.05)
    assert estimated(network, profiles=3) < estimated(network, profiles=1) / 2


@pytest.mark.parametrize(
    "change",
    [
        lambda network: nengo.Probe(network.ensembles[1].neurons[:2], "voltage"),
        lambda network: nengo.Probe(network.ensembles[1].neurons, "input"),
        lambda network: setattr(network.ensembles[1], "neuron_type", nengo.LIF(min_voltage=-1)),
    ],
    ids=["voltage", "input", "min_voltage"],
)
def test_rows_of_blocks_that_are_never_scaled_lose_what_they_lose_unscaled(
    change: Callable[[nengo.Network], object],
) -> None:
    network = pair(1.0, 0.05, n_host=1)
    scaled = estimated(network)
    with network:
        change(network)
    assert estimated(network) > 2 * scaled
    assert measured(network) / 2 < estimated(network) < measured(network) * 2


def test_a_strong_convolution_coarsens_the_weights_beside_it() -> None:
    def convolved(weight: float) -> nengo.Network:
        network = pair(1.0, 0.05)
        with network:
            b = network.ensembles[1]
            b.gain, b.bias = np.ones(N), np.linspace(0.5, 2.0, N)
            pixels = nengo.Ensemble(N, 1, gain=np.ones(N), bias=np.ones(N))
            kernel = np.full((1, 1, 1, 1), weight)
            shared = nengo.Convolution(1, (10, 10, 1), kernel_size=(1, 1), init=kernel)
            nengo.Connection(pixels.neurons, b.neurons, transform=shared)
        return network

    weak, strong = convolved(1e-5), convolved(1e-2)
    assert estimated(strong) > 2 * estimated(weak)
    for network in (weak, strong):
        assert measured(network) / 2 < estimated(network) < measured(network) * 2


def test_a_lossy_path_that_is_set_is_hinted_at() -> None:
    hints = compile_network(pair(0.1, 0.1), pipeline="compact").report.hints
    (hint,) = [one for one in hints if one.id == "SP419"]
    assert "a -> b" in str(hint)
