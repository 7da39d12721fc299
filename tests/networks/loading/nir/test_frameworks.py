"""Graphs in other frameworks, which must have the spikes of NIR's equations as we run them.

Norse and snntorch need torch, and only this test needs them: ``make referees`` puts them into a
folder.
"""

import logging
from pathlib import Path

import nir
import numpy as np
import pytest

import spikeport.nir
from spikeport.networks.loading.nir import equations
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import DT_S, spikes, written

N_STEPS = 200
REASON = "{} is a referee, and not installed: make referees"
FOLDER = Path(__file__).parents[4] / ".referees" / "nir"


@pytest.fixture(autouse=True)
def _referees(monkeypatch):
    """Import the frameworks from where ``make referees`` puts them."""
    monkeypatch.syspath_prepend(FOLDER)


def test_norse_has_the_same_spikes(tmp_path):
    graph = nir_graphs.recurrent(bias=0.1)
    nodes = {name: node for name, node in graph.nodes.items() if name != "again"}
    edges = [edge for edge in graph.edges if "again" not in edge]
    found, wanted = by_norse(tmp_path, nir.NIRGraph(nodes, edges, type_check=False))
    assert wanted.sum() > 10
    assert np.mean(found == wanted) > 0.999  # it computes in float32


def test_norse_has_the_same_spikes_a_step_later_where_neurons_are_recurrent(tmp_path):
    found, wanted = by_norse(tmp_path, nir_graphs.recurrent(bias=0.1))
    assert wanted.sum() > 10
    assert np.mean(found[1:] == wanted[:-1]) > 0.99


def by_norse(folder: Path, graph: nir.NIRGraph) -> tuple[np.ndarray, np.ndarray]:
    """Return the last spikes of Norse, and those of the equations."""
    norse = pytest.importorskip("norse.torch", reason=REASON.format("norse"))
    import torch

    logging.disable(logging.WARNING)  # Norse warns of resistances, which it takes from the graph
    rows = spikes(6, N_STEPS)
    module, state, found = norse.from_nir(nir.read(written(folder, graph)), dt=DT_S), None, []
    with torch.no_grad():
        for row in torch.tensor(rows, dtype=torch.float32):
            spiked, state = module(row[None], state)
            found.append(spiked.numpy().ravel())
    logging.disable(logging.NOTSET)
    folded = spikeport.nir.load(folder / "graph.nir", DT_S).folded
    return np.array(found), equations.run(folded, {"input": rows})["read"]


def test_a_network_exported_by_snntorch_has_the_same_spikes(tmp_path):
    snn = pytest.importorskip("snntorch", reason=REASON.format("snntorch"))
    import torch
    from snntorch.export_nir import export_to_nir

    torch.manual_seed(0)
    # NIR resets neurons in the step of a spike; snntorch's default, one later, loses an input.
    options = {"init_hidden": True, "reset_mechanism": "zero", "reset_delay": False}
    hidden = snn.Leaky(torch.full((12,), 0.9), threshold=torch.ones(12), **options)
    last = snn.Leaky(torch.full((4,), 0.8), threshold=torch.ones(4), **options)
    module = torch.nn.Sequential(torch.nn.Linear(6, 12), hidden, torch.nn.Linear(12, 4), last)
    path = written(tmp_path, export_to_nir(module, torch.zeros(6)))
    rows = spikes(6, N_STEPS, share=0.5)
    hidden.reset_hidden()
    last.reset_hidden()
    with torch.no_grad():
        found = [module(row).numpy() for row in torch.tensor(rows, dtype=torch.float32)]
    folded = spikeport.nir.load(path, 1e-4).folded  # the time step of snntorch's export
    wanted = equations.run(folded, {"input": rows})[list(folded.populations)[-1]]
    assert wanted.sum() > 10
    assert np.mean(np.array(found) == wanted) > 0.999
