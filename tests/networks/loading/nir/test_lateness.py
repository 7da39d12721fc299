"""The steps by which populations are late, and by which spikes arrive early or late."""

import nir
import numpy as np
import pytest

from spikeport.networks.loading.nir.lateness import Lateness
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import folded, lif, weights, wired

FIRST, LAST = nir_graphs.ends(2, 2)


def leads(graph, moved=()):
    late = Lateness(graph, moved)
    return {name: dict(late.leads(one)) for name, one in graph.populations.items()}


def test_inputs_that_are_held_back_arrive_in_time(tmp_path):
    nodes = {"i": FIRST, "a": lif(2), "b": lif(2), "o": LAST}
    found = folded(tmp_path, wired(nodes, "i>a a>b i>b b>o"))
    assert Lateness(found).steps == {"a": 1, "b": 2}
    assert leads(found) == {"a": {}, "b": {}}


def test_spikes_that_skip_a_population_arrive_early_and_feedback_arrives_late(tmp_path):
    nodes = {"a": lif(2), "b": lif(2), "c": lif(2), "i": FIRST, "o": LAST}
    nodes["w"] = weights(2, 2)
    found = folded(tmp_path, wired(nodes, "i>c c>b b>a a>w w>c c>a a>o"))
    assert leads(found) == {"c": {"a": -2}, "b": {}, "a": {"c": 1}}


def test_a_readout_and_the_spikes_it_reads_are_equally_late(tmp_path):
    nodes = {"i": FIRST, "a": lif(2), "r": nir.LI(*np.ones((3, 2)) * 0.01), "o": LAST}
    found = folded(tmp_path, wired(nodes, "i>a a>r i>r r>o"))
    assert leads(found)["r"] == {}


def test_an_output_gets_inputs_and_shallow_populations_early(tmp_path):
    nodes = {"i": FIRST, "a": lif(2), "b": lif(2), "o": LAST, "p": LAST}
    found = folded(tmp_path, wired(nodes, "i>a a>b i>o a>o b>o b>p"))
    assert dict(Lateness(found).output_leads("o")) == {"i": 3, "a": 1}
    assert not list(Lateness(found).output_leads("p"))


@pytest.mark.parametrize(
    ("moved", "steps", "early"),
    [("", [1, 2, 3], {"a": 1}), ("a", [1, 2, 3], {"a": 1}), ("b", [1, 3, 4], {"a": 2}),
     ("c", [1, 2, 4], {"a": 1}), ("ab", [1, 2, 3], {"a": 1}), ("bc", [1, 3, 4], {"a": 1})],
)  # fmt: skip
def test_spikes_that_leave_the_chip_for_a_moved_population_take_a_step_more(
    tmp_path, moved, steps, early
):
    nodes = {"i": FIRST, "a": lif(2), "b": lif(2), "c": lif(2), "o": LAST}
    found = folded(tmp_path, wired(nodes, "i>a a>b b>c a>c c>o"))
    assert list(Lateness(found, moved).steps.values()) == steps
    assert leads(found, moved)["c"] == early
