"""Agreement with NIR's equations, and the spikes it is measured on."""

import nir
import numpy as np
import pytest

import spikeport.nir
from spikeport.commands.agreement import compartments, measured, moved, spikes_of
from spikeport.errors import UsageError
from spikeport.networks.loading.nir.differences import differences
from spikeport.networks.loading.nir.populations import PopulationGraph
from tests.helpers import nir_graphs
from tests.helpers.chip_files import chip_file
from tests.helpers.nir_graphs import DT_S, spikes, written


@pytest.fixture
def network(tmp_path):
    return spikeport.nir.load(written(tmp_path, nir_graphs.recurrent(bias=0.2)), DT_S)


def test_the_chip_agrees_with_nirs_equations_and_less_if_they_are_changed(network):
    compilation = spikeport.compile_network(network)
    played = spikes_of(network.folded, "random")
    hidden, read = measured(network, compilation, played)
    assert (hidden.name, read.name) == ("hidden", "read")
    assert hidden.equal > max(0.98, hidden.silent)
    network.folded.populations["hidden"].dynamics.threshold[:] = 0.2  # the equations fire more
    other, _ = measured(network, compilation, played)
    assert other.spikes == hidden.spikes < other.wanted
    n_missed = other.wanted - other.spikes
    assert other.equal < 1 - n_missed / (256 * 12) + 1e-9


def test_compartments_of_both_populations_are_distinct_and_complete(network):
    image = spikeport.compile_network(network).image
    found = [compartments(image, name) for name in ("hidden", "read")]
    assert sorted(np.concatenate(found).tolist()) == list(range(16))


def test_a_population_that_was_moved_to_the_host_is_left_out_and_described(tmp_path):
    graph = written(tmp_path, nir_graphs.recurrent(bias=0.2))
    network = spikeport.nir.load(graph, DT_S, parts=1)
    chip = chip_file(tmp_path / "small.toml", in_axons=15)  # hidden needs 18, read 12
    compilation = spikeport.compile_network(network, chip, offload=True)
    away = moved(network, compilation.report)
    assert away == {"hidden"}
    (read,) = measured(network, compilation, spikes_of(network.folded, "random"))
    assert read.name == "read"
    texts = [text for name, text in differences(network, away) if name == "hidden"]
    assert texts == ["moved to the host, where Nengo computes it in floating point"]


def test_neurons_behind_a_moved_population_agree_one_step_later(tmp_path):
    first, last = nir_graphs.ends(4, 3)
    rng = np.random.default_rng(0)
    nodes = {"i": first, "p": nir_graphs.lif(20), "q": nir_graphs.lif(4), "r": nir_graphs.lif(3)}
    nodes |= {
        name: nir.Linear(weight=rng.random((n_out, n_in)) * most)
        for name, n_out, n_in, most in (("a", 20, 4, 0.9), ("b", 4, 20, 0.15), ("c", 3, 4, 0.9))
    }
    nodes["o"] = last
    graph = nir_graphs.wired(nodes, "i>a a>p p>b b>q q>c c>r r>o")
    network = spikeport.nir.load(written(tmp_path, graph), DT_S, parts=1)
    chip = chip_file(tmp_path / "small.toml", in_axons=15)  # q needs 20
    compilation = spikeport.compile_network(network, chip, offload=True)
    away = moved(network, compilation.report)
    assert away == {"q"}
    _, r = measured(network, compilation, spikes_of(network.folded, "random"))
    assert r.equal > 0.99 > r.silent
    assert ("r", "spikes are 4 steps late: each connection takes one, and the way to the host "
            "one more") in differences(network, away)  # fmt: skip


def test_spikes_of_a_file_are_taken_as_they_are(network, tmp_path):
    rows = spikes(6, 30)
    np.savez(tmp_path / "in.npz", input=rows.reshape(30, 2, 3).astype(bool))
    played = spikes_of(network.folded, str(tmp_path / "in.npz"))
    np.testing.assert_array_equal(played.rows["input"], rows)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"other": np.zeros((3, 6))}, "expected an array of numbers input, found none"),
        (
            {"input": np.zeros((3, 5))},
            "expected input of shape (n_steps, 6), of one step or more, found (3, 5)",
        ),
        ({"input": np.full((3, 6), 0.5)}, "expected values of 0 and 1 in input, found 0.5"),
        (
            {"input": np.zeros((0, 6))},
            "expected input of shape (n_steps, 6), of one step or more, found (0, 6)",
        ),
    ],
)
def test_files_without_fitting_spikes_are_refused(network, tmp_path, arrays, message):
    path = tmp_path / "in.npz"
    np.savez(path, **arrays)
    with pytest.raises(UsageError) as caught:
        spikes_of(network.folded, str(path))
    assert str(caught.value).startswith(f"{path}: {message}")
    assert str(caught.value).endswith("; give an npz with arrays of 0 and 1: input (n_steps, 6)")


def test_inputs_of_a_file_with_different_numbers_of_steps_are_refused(tmp_path):
    graph = PopulationGraph(DT_S, {"a": (2,), "b": (3,)}, {}, {})
    path = tmp_path / "in.npz"
    np.savez(path, a=np.zeros((4, 2)), b=np.zeros((5, 3)))
    with pytest.raises(UsageError) as caught:
        spikes_of(graph, str(path))
    assert str(caught.value) == (
        f"{path}: expected the same number of steps for each input, found different numbers; give "
        "an npz with arrays of 0 and 1: a (n_steps, 2), b (n_steps, 3)"
    )


def test_a_graph_without_an_input_takes_no_spikes():
    with pytest.raises(UsageError) as caught:
        spikes_of(PopulationGraph(DT_S, {}, {}, {}), "random")
    assert str(caught.value) == "--spikes random: the graph has no input; leave --spikes out"


def test_a_file_that_is_not_there_is_refused(network, tmp_path):
    with pytest.raises(UsageError, match=r"in\.npz: no such file"):
        spikes_of(network.folded, str(tmp_path / "in.npz"))
