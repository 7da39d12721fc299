"""Ensembles whose decoders and encoders are known, so that products can be computed by hand."""

from typing import Any

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.solvers import NoSolver

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import Scope
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.edges import EdgeMatrices
from spikeport.compile.rewriting.links import Link
from spikeport.compile.rewriting.partition import Part, Partition
from spikeport.compile.rewriting.passthrough import foldable
from spikeport.simulator import Simulator

DT_S = 0.001
FAST, SLOW = nengo.Lowpass(0.005), nengo.Lowpass(0.1)
LINK = Link(
    sparse.csr_array(np.array([[1.0, 1.0, 2.0, 0.0, 3.0], [0.0, 0.0, 2.0, 0.0, 1.0]])),
    sparse.csr_array(np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])),
    gains=np.array([10.0, 20.0, 30.0]),
)
"""Link of five neurons to three, over two dimensions; one is not decoded, two are alike."""


def ensemble(label: str, n: int, dimensions: int = 1, **options: Any) -> nengo.Ensemble:
    """Return an ensemble with gains, biases and encoders that differ from neuron to neuron."""
    encoders = np.arange(1.0, n * dimensions + 1).reshape(n, dimensions)
    options = {"encoders": encoders, "normalize_encoders": False} | options
    gain, bias = np.arange(1.0, n + 1), np.arange(n) / 10
    return nengo.Ensemble(n, dimensions, gain=gain, bias=bias, label=label, **options)


def decoders(n: int, d: int) -> np.ndarray:
    """Return an (n, d) array of different numbers."""
    return np.arange(1.0, n * d + 1).reshape(n, d) / 100


def decode(pre: Any, post: Any, values: np.ndarray, **options: Any) -> nengo.Connection:
    """Connect with decoders (n, d)."""
    if "function" not in options and values.shape[1] != pre.size_out:
        options["function"] = lambda _x: np.zeros(values.shape[1])
    return nengo.Connection(pre, post, solver=NoSolver(values), **options)


def rewrite_of(network: nengo.Network) -> Rewrite:
    return Rewrite(network, Names(network))


def scope_of(network: nengo.Network) -> Scope:
    return Scope(network, Names(network))


def whole(*groups: Any) -> Partition:
    """Return groups of whole ensembles: one, or a tuple of several."""
    tuples = (group if isinstance(group, tuple) else (group,) for group in groups)
    return Partition([[Part(e, 0, e.n_neurons) for e in group] for group in tuples])


def matrices_of(network: nengo.Network, partition: Partition) -> EdgeMatrices:
    """Return the edges of a network whose passthrough nodes are multiplied out."""
    folded = foldable(scope_of(network))
    rewrite = rewrite_of(network)
    solver = ParameterSolver(rewrite, DT_S)
    return EdgeMatrices(rewrite, [], solver, partition, folded)


def probed(network: nengo.Network, probe: nengo.Probe, *pipelines: str) -> list[np.ndarray]:
    """Return the values (300, n) that a probe records on the chip, for each pipeline."""
    found = []
    for pipeline in pipelines:
        with Simulator(network, pipeline=pipeline) as sim:
            sim.run_steps(300)
            found.append(sim.data[probe])
    return found
