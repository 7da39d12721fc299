"""Small NIR graphs, written with the package nir; spikeport reads them without it."""

import itertools
from pathlib import Path

import nir
import numpy as np

from spikeport.networks.loading.nir.fold import fold
from spikeport.networks.loading.nir.graph import flattened
from spikeport.networks.loading.nir.populations import PopulationGraph
from spikeport.reading.hdf5 import read

DT_S = 1e-3


def cuba(n: int, tau_syn: float = 4e-3, tau_mem: float = 1e-2, **changes: float) -> nir.CubaLIF:
    """Return current-based neurons whose voltage a weight of 1 moves by 1."""
    values = {
        "tau_syn": tau_syn,
        "tau_mem": tau_mem,
        "r": tau_mem / DT_S,
        "v_leak": 0.0,
        "v_threshold": 1.0,
        "v_reset": 0.0,
        "w_in": tau_syn / DT_S,
    } | changes
    return nir.CubaLIF(**{name: np.full(n, value) for name, value in values.items()})


def lif(n: int, tau: float = 1e-2, **changes: float) -> nir.LIF:
    """Return neurons without a current of their own."""
    values = {"tau": tau, "r": tau / DT_S, "v_leak": 0.0, "v_threshold": 1.0, "v_reset": 0.0}
    return nir.LIF(**{name: np.full(n, value) for name, value in (values | changes).items()})


def integrate(*shape: int) -> nir.IF:
    """Return neurons that integrate and fire."""
    return nir.IF(r=np.ones(shape), v_threshold=np.ones(shape), v_reset=np.zeros(shape))


def affine(rng: np.random.Generator, n_out: int, n_in: int, bias: float = 0.0) -> nir.Affine:
    """Return weights that make most neurons fire now and then."""
    weight = rng.normal(0.06, 0.25, (n_out, n_in)) / np.sqrt(n_in)
    return nir.Affine(weight=weight, bias=rng.normal(0, bias, n_out) if bias else np.zeros(n_out))


def weights(n_out: int, n_in: int, value: float = 1.0, bias: float = 0.0) -> nir.Affine:
    """Return equal weights and biases."""
    return nir.Affine(weight=np.full((n_out, n_in), value), bias=np.full(n_out, bias))


def graph(**nodes: nir.NIRNode) -> nir.NIRGraph:
    """Return a graph of nodes that follow each other."""
    names = list(nodes)
    edges = list(itertools.pairwise(names))
    return nir.NIRGraph(nodes=nodes, edges=edges, type_check=False)


def wired(nodes: dict[str, nir.NIRNode], edges: str) -> nir.NIRGraph:
    """Return a graph of nodes with edges such as `"i>n n>o"`."""
    pairs = [tuple(edge.split(">")) for edge in edges.split()]
    return nir.NIRGraph(nodes=nodes, edges=pairs, type_check=False)


def ends(n_in: int, n_out: int) -> tuple[nir.Input, nir.Output]:
    """Return an input and an output."""
    return (
        nir.Input(input_type={"input": np.array([n_in])}),
        nir.Output(output_type={"output": np.array([n_out])}),
    )


def recurrent(bias: float = 0.0, seed: int = 0) -> nir.NIRGraph:
    """Return 6 inputs, 12 recurrent neurons with a filtered current, and 4 that read them."""
    rng = np.random.default_rng(seed)
    first, last = ends(6, 4)
    nodes = {
        "input": first,
        "in": affine(rng, 12, 6, bias),
        "hidden": cuba(12),
        "again": affine(rng, 12, 12, bias),
        "out": affine(rng, 4, 12, bias),
        "read": cuba(4, tau_syn=2e-3, tau_mem=5e-3),
        "output": last,
    }
    edges = [("input", "in"), ("in", "hidden"), ("hidden", "again"), ("again", "hidden")]
    edges += [("hidden", "out"), ("out", "read"), ("read", "output")]
    return nir.NIRGraph(nodes=nodes, edges=edges, type_check=False)


def convolutional() -> nir.NIRGraph:
    """Return a small convolutional graph: two channels of 6 by 6 to three neurons."""
    rng = np.random.default_rng(1)
    weight = rng.normal(0.03, 0.2, (3, 2, 3, 3))
    one = (1, 1)
    return graph(
        input=nir.Input(input_type={"input": np.array([2, 6, 6])}),
        conv=nir.Conv2d((6, 6), weight, one, one, one, 1, np.zeros(3)),
        hidden=integrate(3, 6, 6),
        pool=nir.SumPool2d(np.array([2, 2]), np.array([2, 2]), np.array([0, 0])),
        flat=nir.Flatten({"input": np.array([3, 3, 3])}, start_dim=0),
        out=affine(rng, 3, 27),
        read=integrate(3),
        output=ends(1, 3)[1],
    )


def nested() -> nir.NIRGraph:
    """Return a graph with a graph in it, whose neurons have a leak voltage and a threshold."""
    rng = np.random.default_rng(2)
    first, last = ends(5, 4)
    inner = graph(
        input=ends(5, 1)[0],
        scale=nir.Scale(scale=np.full(5, 6.0)),
        weights=affine(rng, 8, 5),
        neurons=lif(8, v_leak=0.5, v_reset=-0.25),
        output=ends(1, 8)[1],
    )
    return graph(
        input=first,
        inner=inner,
        out=affine(rng, 4, 8),
        delay=nir.Delay(delay=np.full(4, DT_S)),
        gate=nir.Threshold(threshold=np.full(4, 0.1)),
        output=last,
    )


def written(folder: Path, graph: nir.NIRGraph, name: str = "graph.nir") -> Path:
    """Write a graph, and return its path."""
    path = folder / name
    nir.write(path, graph)
    return path


def folded(folder: Path, graph: nir.NIRGraph, dt_s: float = DT_S) -> PopulationGraph:
    """Write a graph and read it back, as a graph of populations."""
    return fold(flattened(read(written(folder, graph))), dt_s)


def spikes(n: int, n_steps: int = 150, share: float = 0.2, seed: int = 3) -> np.ndarray:
    """Return random spikes, (n_steps, n)."""
    return (np.random.default_rng(seed).random((n_steps, n)) < share).astype(float)
