import contextlib
from functools import partial

import nengo
import numpy as np
import pytest
import scipy.sparse
from nengo.exceptions import BuildError

from spikeport import add_params
from spikeport.compile.check.hints import filter_hints, image_hints, network_hints
from spikeport.compile.ground.filters import Passage
from spikeport.compile.ground.quantisation import BlockError
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network
from tests.helpers.chip_networks import wired
from tests.helpers.cured import network_of
from tests.helpers.hint_cures import relayed_pair
from tests.helpers.small_networks import scope_of


def hints(image: ChipImage, *errors: BlockError) -> list[str]:
    return [str(hint) for hint in image_hints(image, errors)]


def test_a_block_whose_weights_are_all_zero_gets_a_hint() -> None:
    assert "post: SP402 zero weights: all of its weights are 0; cure: remove the connection" in (
        "\n".join(hints(wired([[0, 0]], [2.0])))
    )
    assert "SP402" not in "\n".join(hints(wired([[0, 1]], [2.0])))


def test_weights_of_zero_that_learn_get_no_hint() -> None:
    with nengo.Network(seed=1) as network:
        a, out = nengo.Ensemble(20, 1), nengo.Node(size_in=1)
        zero = {"function": lambda x: 0}
        learned = nengo.Connection(a, out, **zero, learning_rule_type=nengo.PES())
        nengo.Connection(out, learned.learning_rule)
        plain = nengo.Node(lambda t, x: None, size_in=1)
        nengo.Connection(a, plain, **zero)
    found = [hint for hint in compile_network(network).report.hints if hint.id == "SP402"]
    assert [hint.object for hint in found] == ["ensembles[0] -> read-out"]


@pytest.mark.parametrize(("copies", "n_hints"), [(1, 0), (2, 0), (3, 1)])
def test_copies_get_a_hint_above_a_tenth_of_the_neurons(copies: int, n_hints: int) -> None:
    bias = [0.1 * max(n, copies) for n in range(20)]
    found = [one for one in hints(wired([[1, 1]] * 20, bias)) if "SP404" in one]
    assert len(found) == n_hints


def test_lost_weights_get_a_hint_above_a_tenth_of_the_weights() -> None:
    image = wired([[1, 1]], [1.0])
    few, many = BlockError("few", 0, 0, 0.1), BlockError("many", 0, 0, 0.25)
    assert hints(image, few, many)[0].startswith("many: SP403 weights lost: 25 % of them; cure: ")


@pytest.mark.parametrize("kind", ["ensemble", "readout"])
def test_lost_weights_of_read_outs_are_not_said_to_be_cured_by_compact(kind: str) -> None:
    """No pass scales the rows of a read-out: the host reads them in the builder's units."""
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(20, 1, label="a")
        nengo.Probe(a)
    image = compile_network(network).image
    (label,) = (entry.label for entry in image.manifest.blocks if entry.kind == kind)
    (hint,) = (one for one in hints(image, BlockError(label, 0, 0, 0.5)) if "SP403" in one)
    assert ("compile it with `-p compact`" in hint) == (kind == "ensemble")


@pytest.mark.parametrize("label", ["a", "left -> right"])
def test_a_connection_rounded_to_zero_beside_another_gets_a_hint(label: str) -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 1, label=label), nengo.Ensemble(20, 1, label="b")
        for weight in (1e-2, 1e-9):
            nengo.Connection(a.neurons, b.neurons, transform=np.full((20, 20), weight))
    (found,) = (hint for hint in compile_network(network).report.hints if hint.id == "SP402")
    assert found.object == f"{label} -> b"
    assert found.used == "all of its weights are rounded to 0"


@pytest.mark.parametrize("synapse", [None, 0.005])
def test_a_loop_on_the_chip_gets_a_hint_exactly_if_nengo_refuses_it(synapse: float | None) -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(4, 1, label="a"), nengo.Ensemble(4, 1, label="b")
        through = nengo.Node(size_in=1)
        nengo.Connection(a.neurons, b.neurons, transform=np.eye(4) / 1000, synapse=None)
        nengo.Connection(b, through, synapse=None)
        nengo.Connection(through, a, synapse=synapse)
        nengo.Connection(a, nengo.Node(size_in=1), synapse=None)
    found = [one for one in compile_network(network).report.hints if one.id == "SP416"]
    assert [one.object for one in found] == ["nodes[0] -> a"] * (synapse is None)
    with contextlib.nullcontext() if synapse else pytest.raises(BuildError, match="cycles"):
        nengo.Simulator(network, progress_bar=False).close()


RECTIFIED = nengo.RegularSpiking(nengo.RectifiedLinear())
SPARSE = {"shape": (4, 4), "indices": [[0, 1], [2, 3]]}


@pytest.mark.parametrize(
    ("transform", "negative"),
    [
        (0.1, False),
        (-0.1, True),
        (np.eye(4) - 0.5, True),
        (nengo.dists.Uniform(-1, 1), True),
        (nengo.dists.Uniform(0, 1), False),
        (nengo.Sparse(**SPARSE, init=[0.5, -0.5]), True),
        (nengo.Sparse(**SPARSE, init=[0.5, 0.5]), False),
        (nengo.Sparse((4, 4), init=scipy.sparse.csr_matrix(np.eye(4) - 0.5)), True),
        (nengo.Convolution(4, (2, 2, 1), kernel_size=(2, 2), init=-np.ones((2, 2, 1, 4))), True),
    ],
)
@pytest.mark.parametrize("kind", [nengo.SpikingRectifiedLinear(), nengo.LIF()])
def test_rectified_neurons_that_others_inhibit_get_a_hint(
    kind: nengo.neurons.NeuronType, transform: object, negative: bool
) -> None:
    with nengo.Network(seed=1) as network:
        a, b = (nengo.Ensemble(4, 1, neuron_type=kind, label=label) for label in "ab")
        nengo.Connection(a.neurons, b.neurons, transform=transform)
    found = [hint for hint in network_hints(scope_of(network)) if hint.id == "SP418"]
    assert [hint.object for hint in found] == ["b"] * (negative and type(kind) is not nengo.LIF)


def test_rectified_neurons_on_the_host_get_no_hint_of_inhibition() -> None:
    with nengo.Network(seed=1) as network:
        add_params(network)
        a, b = (nengo.Ensemble(4, 1, neuron_type=RECTIFIED) for _ in range(2))
        nengo.Connection(a.neurons, b.neurons[[0, 0, 1, 1]], transform=-0.1)
    hints = [hint.id for hint in network_hints(scope_of(network))]
    assert hints.count("SP418") == 1
    network.config[b].on_chip = False
    assert list(network_hints(scope_of(network))) == []


def test_a_passthrough_node_that_leads_nowhere_gets_a_hint() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(4, 1, label="a")
        end = nengo.Node(size_in=1, label="end")
        nengo.Connection(a, end)
        probed, passed = nengo.Node(size_in=1), nengo.Node(size_in=1)
        nengo.Connection(a, probed)
        nengo.Probe(probed)
        nengo.Connection(a, passed)
        nengo.Connection(passed, a)
    assert [str(hint) for hint in network_hints(scope_of(network))] == [
        "end: SP401 dead end: leads nowhere and is not probed; cure: probe it, or give it a "
        "function, as in nengo.Node(lambda t, x: x, size_in=...)"
    ]


def test_a_node_that_stays_on_the_host_to_be_learned_is_no_dead_end() -> None:
    with nengo.Network(seed=1) as network:
        a, out, error = nengo.Ensemble(4, 1), nengo.Node(size_in=1), nengo.Node(size_in=1)
        learned = nengo.Connection(a, out, learning_rule_type=nengo.PES())
        nengo.Connection(error, learned.learning_rule)
        nengo.Connection(nengo.Node(0.5), error)
    assert list(network_hints(scope_of(network))) == []


def test_no_node_is_a_dead_end_if_all_passthrough_nodes_stay() -> None:
    with nengo.Network(seed=1) as network:
        nengo.Connection(nengo.Ensemble(4, 1), nengo.Node(size_in=1))
    assert list(network_hints(scope_of(network), remove_passthrough=False)) == []


def passage(source: str, target: str, own_ms: float, *filters_ms: float) -> Passage:
    """Return a passage with the filters of its relay, if it has one, and of its target."""
    *relay_s, target_s = (ms / 1000 for ms in filters_ms)
    name = f"{source} -> {target}"
    return Passage(name, source, target, own_ms / 1000, *(relay_s or [None]), target_s)


def filters(*passages: Passage) -> list[tuple[str, str, str]]:
    return [(h.id, h.object, h.used) for h in filter_hints(passages, 0.001)]


def test_different_filters_of_one_ensemble_get_a_hint() -> None:
    alike = passage("", "a", 5, 5), passage("b", "a", 8, 8, 5)
    assert filters(*alike) == []
    assert filters(*alike, passage("b", "a", 100, 100)) == [
        ("SP409", "a", "5 and 100 ms, all filtered with 100 ms")
    ]


def test_loops_that_relays_slow_down_get_a_hint() -> None:
    there, back = passage("a", "b", 100, 94, 5), passage("b", "a", 5, 5, 5)
    assert filters(there, back) == [("SP410", "b -> a", "5 ms became 11 ms")]
    assert filters(there, passage("b", "c", 5, 5, 5)) == []
    assert filters(passage("a", "a", 100, 100, 5)) == [("SP410", "a -> a", "100 ms became 106 ms")]
    assert filters(passage("a", "a", 20, 20)) == []
    assert filters() == []


def test_a_hint_on_a_rewritten_network_does_not_advise_to_rewrite_it() -> None:
    slow = passage("a", "a", 5, 5, 5)
    cures = [next(filter_hints([slow], 0.001, rewritten)).cure for rewritten in (False, True)]
    assert cures[0].startswith("compile with `-p compact`")
    assert "wire it neuron to neuron" in cures[1]


def found(network: nengo.Network, pipeline: str = "as_written") -> set[str]:
    return {hint.id for hint in compile_network(network, pipeline=pipeline).report.hints}


def inhibited(synapse: float) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
        nengo.Connection(a, b, synapse=0.1)
        nengo.Connection(a.neurons, b.neurons, transform=-np.eye(20) / 1000, synapse=synapse)
    return network


def test_a_synapse_of_5_ms_to_neurons_cures_a_shared_filter() -> None:
    assert "SP409" in found(inhibited(0.02))
    assert "SP409" not in found(inhibited(0.005))


@pytest.mark.parametrize("tau", [0.1, 0.005])
def test_the_compact_pipeline_cures_a_slower_loop(tau: float) -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(20, 1)
        nengo.Connection(nengo.Node([1]), a)
        nengo.Connection(a, a, synapse=tau)
    assert "SP410" in found(network)
    assert "SP410" not in found(network, "compact")


def test_unread_outputs_of_an_ensemble_array_are_not_reported_as_dead_ends() -> None:
    with nengo.Network(seed=1) as network:
        array = nengo.networks.EnsembleArray(4, 2)
        squares = array.add_output("squares", np.square)
        nengo.Probe(squares)
    assert list(network_hints(scope_of(network))) == []


def test_an_ensemble_with_an_arrow_in_its_label_is_not_taken_for_a_relay() -> None:
    """The kind of a block is a field of its own, not read from its label."""
    with nengo.Network(seed=1) as network:
        encoders = np.ones((10, 1))
        one = {"gain": np.ones(10), "bias": np.ones(10), "encoders": encoders}
        nengo.Ensemble(10, 1, label="left -> right", **one)
    hints = compile_network(network).report.hints
    assert [(hint.id, hint.object, hint.used) for hint in hints] == [
        ("SP404", "left -> right", "9 of 10")
    ]


@pytest.mark.parametrize(
    ("path", "has_effect"), [("direct", False), ("host", False), ("onoff", True), ("auto", True)]
)
def test_a_path_that_no_pass_takes_is_named(path: str, has_effect: bool) -> None:
    network = network_of(partial(relayed_pair, path))
    found = [one for one in compile_network(network).report.hints if one.id == "SP425"]
    assert [one.used for one in found] == ([] if has_effect else [path])
