"""Populations: the steps by which spikes arrive early or late."""

import nir
import numpy as np

from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import folded, lif, weights, wired

FIRST, LAST = nir_graphs.ends(2, 2)


def test_inputs_of_deep_neurons_are_held_back(tmp_path):
    nodes = {"i": FIRST, "a": lif(2), "b": lif(2), "o": LAST}
    found = folded(tmp_path, wired(nodes, "i>a a>b i>b b>o"))
    assert [found.held_steps(one) for one in found.populations.values()] == [0, 1]
    assert not [lead for one in found.populations.values() for lead in found.lead_steps(one)]


def test_spikes_that_skip_a_population_arrive_early_and_feedback_arrives_late(tmp_path):
    nodes = {"a": lif(2), "b": lif(2), "c": lif(2), "i": FIRST, "o": LAST}
    nodes["w"] = weights(2, 2)
    found = folded(tmp_path, wired(nodes, "i>c c>b b>a a>w w>c c>a a>o"))
    leads = {name: dict(found.lead_steps(one)) for name, one in found.populations.items()}
    assert leads == {"c": {"a": -2}, "b": {}, "a": {"c": 1}}


def test_a_readout_and_the_spikes_it_reads_are_equally_late(tmp_path):
    nodes = {"i": FIRST, "a": lif(2), "r": nir.LI(*np.ones((3, 2)) * 0.01), "o": LAST}
    found = folded(tmp_path, wired(nodes, "i>a a>r i>r r>o"))
    assert not list(found.lead_steps(found.populations["r"]))


def test_an_output_gets_inputs_and_shallow_populations_early(tmp_path):
    nodes = {"i": FIRST, "a": lif(2), "b": lif(2), "o": LAST, "p": LAST}
    found = folded(tmp_path, wired(nodes, "i>a a>b i>o a>o b>o b>p"))
    assert dict(found.output_lead_steps("o")) == {"i": 3, "a": 1}
    assert not list(found.output_lead_steps("p"))
