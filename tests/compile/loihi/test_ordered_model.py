"""Reproducible images of nengo-loihi's model, and factors of what the host reads."""

import functools
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import nengo
import numpy as np
import pytest
from nengo_loihi.passthrough import PassthroughSplit

import spikeport
from spikeport.compile.pipeline import compile_network
from spikeport.simulator import Simulator


def test_an_unseeded_network_gives_the_same_image_every_time(
    chain: Callable[..., nengo.Network],
) -> None:
    digests = set()
    for seed in (1, 2):
        np.random.seed(seed)
        digests.add(compile_network(chain(seed=None)).image.digest)
    assert len(digests) == 1


def test_another_seed_gives_another_image(chain: Callable[..., nengo.Network]) -> None:
    assert compile_network(chain(seed=1)).image != compile_network(chain(seed=2)).image


PASSTHROUGH = """
import sys
import warnings
import nengo
import spikeport

def arrays():
    a = nengo.networks.EnsembleArray(10, 3)
    b = nengo.networks.EnsembleArray(10, 3, ens_dimensions=1)
    nengo.Connection(a.output, b.input, transform=[[0, 1, 0], [1, 0, 1], [0.5, 0, -1]])
    nengo.Probe(b.output)

def product():
    product = nengo.networks.Product(10, 2)
    a = nengo.Ensemble(20, 2)
    b = nengo.Ensemble(20, 2)
    nengo.Connection(a, product.input_a)
    nengo.Connection(a, product.input_b, function=lambda x: x[::-1])
    nengo.Connection(product.output, b)

def basal_ganglia():
    bg = nengo.networks.BasalGanglia(2, n_neurons_per_ensemble=10)
    thalamus = nengo.networks.Thalamus(2, n_neurons_per_ensemble=10)
    a = nengo.Ensemble(20, 2)
    nengo.Connection(bg.output, thalamus.input)
    nengo.Connection(a, bg.input)
    nengo.Connection(thalamus.output, a)

warnings.simplefilter("ignore")
for make in (arrays, product, basal_ganglia):
    with nengo.Network() as network:
        make()
    print(spikeport.compile_network(network).image.digest)
"""


@pytest.mark.slow
def test_networks_with_passthrough_nodes_give_the_same_image_in_every_process() -> None:
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", PASSTHROUGH],
            env={**os.environ, "PYTHONHASHSEED": seed, "OMP_NUM_THREADS": "1"},
            stdout=subprocess.PIPE,
            text=True,
        )
        for seed in ("1", "2", "3")
    ]
    outputs = [run.communicate(timeout=60)[0].split() for run in runs]
    assert [len(digests) for digests in outputs] == [3, 3, 3]
    assert outputs[0] == outputs[1] == outputs[2]


def described(connection: nengo.Connection) -> str:
    function = connection.function
    value = function(np.array([0.3])) if callable(function) else function
    return str((type(connection.pre_obj), connection.synapse, value, connection.eval_points))


class Forwards(set[nengo.Connection]):
    """A set of connections in an order that does not depend on where they are in memory."""

    def __iter__(self) -> Iterator[nengo.Connection]:
        return iter(sorted(super().__iter__(), key=described))


class Backwards(Forwards):
    """A set of connections in the reverse of the order of `Forwards`."""

    def __iter__(self) -> Iterator[nengo.Connection]:
        return iter(list(super().__iter__())[::-1])


POINTS = np.linspace(-1, 1, 9)[:, np.newaxis]
SHIFTED = [functools.partial(np.add, 0.1), functools.partial(np.add, 0.5)]


@pytest.mark.parametrize(
    "options",
    [
        [{"synapse": 0.005}, {"synapse": 0.1}],
        [{"function": one} for one in SHIFTED],
        [{"eval_points": POINTS, "function": one} for one in (POINTS, -POINTS)],
        [{"eval_points": one} for one in (POINTS, POINTS / 2)],
    ],
    ids=["synapse", "function", "table", "points"],
)
def test_images_do_not_depend_on_the_set_order_of_connections_that_replace_nodes(
    options: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def digest(kind: type[Forwards]) -> str:
        class Ordered(PassthroughSplit):
            """A split whose new connections are in the order of ``kind``."""

            def __init__(self, *args: object) -> None:
                super().__init__(*args)
                self.to_add = kind(self.to_add)

        monkeypatch.setattr("nengo_loihi.splitter.PassthroughSplit", Ordered)
        with nengo.Network(seed=1) as network:
            a, b = nengo.Ensemble(20, 1, label="a"), nengo.Ensemble(20, 1, label="b")
            for one in options:
                node = nengo.Node(size_in=1)
                nengo.Connection(a, node, **({"synapse": None} | one))
                nengo.Connection(node, b, synapse=None)
        return compile_network(network).image.digest

    assert digest(Forwards) == digest(Backwards)


def spikes_to_node(
    transform: object, n: int = 10, neurons: slice = slice(3), **options: object
) -> nengo.Network:
    """Return neurons on the chip whose spikes go to a node on the host."""
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(n, 1, label="a", **options)
        node = nengo.Node(lambda _t, x: x, size_in=len(range(n)[neurons]), label="node")
        nengo.Connection(a.neurons[neurons], node, transform=transform, synapse=None)
        nengo.Probe(node)
    return network


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("amplitude", [1.0, 0.5])
def test_a_factor_for_each_spike_that_is_read_equals_the_matrix_of_factors(
    pipeline: str, amplitude: float
) -> None:
    factors, kind = [1.0, 2.0, 3.0], nengo.LIF(amplitude=amplitude)
    found, wanted = (
        compile_network(spikes_to_node(one, neuron_type=kind), pipeline=pipeline).image
        for one in (factors, np.diag(factors))
    )
    assert found.digest == wanted.digest


@pytest.mark.slow
def test_factors_of_spikes_are_received_on_the_host() -> None:
    data = []
    for factors in ([1.0, 2.0, 3.0], [1.0, 1.0, 1.0]):
        network = spikes_to_node(factors, intercepts=nengo.dists.Choice([-1.0]))
        with Simulator(network, progress_bar=False) as simulator:
            simulator.run_steps(100)
            data.append(simulator.data[network.probes[0]])
    assert data[1].any(axis=0).all()
    np.testing.assert_allclose(data[0], data[1] * [1, 2, 3])


def test_a_factor_for_each_neuron_of_a_split_ensemble_equals_the_matrix_of_factors() -> None:
    factors = np.linspace(1, 2, 1500)
    found, wanted = (
        compile_network(spikes_to_node(one, 1500, slice(None))).image
        for one in (factors, np.diag(factors))
    )
    assert found.digest == wanted.digest


def test_one_factor_of_one_neuron_stays_a_factor() -> None:
    image = compile_network(spikes_to_node([2.0], neurons=slice(1))).image
    assert [one.weights for one in image.manifest.outputs] == ["scale"]


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_kinds_of_decode_neurons_are_set_for_targets_on_the_chip_alone(pipeline: str) -> None:
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        network.config[nengo.Connection].decode_path = "preset10"
        u, a = nengo.Node(0.5), nengo.Ensemble(20, 1)
        # Targets and error sources of learning stay on the host.
        error, post = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
        for end in (a, error):
            nengo.Connection(u, end)
        learned = nengo.Connection(a, post, learning_rule_type=nengo.PES())
        nengo.Connection(error, learned.learning_rule)
    blocks = compile_network(network, pipeline=pipeline).image.manifest.blocks
    assert [block.kind for block in blocks] == ["ensemble", "readout"]
