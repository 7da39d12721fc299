"""Estimates of the memory that a compile will take, before anything is built, and of free memory.

    M = sum over objects of the bytes of each
        + 150 B W + 700 B S + 70 B R + 25 B T + max(10 B n p + 52 B min(n, p)^2)

for W weights, S weights of sparse matrices, R weights to neurons that relay decoded values, T
weights from these, and n neurons and p evaluation points of the decoders that take most memory. The
figures were fitted to peaks of fresh processes (docs/architecture.md compares estimates and peaks).
"""

import math
import os
from collections.abc import Iterator
from pathlib import Path

import nengo
import numpy as np
from nengo.dists import Distribution
from nengo.ensemble import Neurons

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.names import base
from spikeport.compile.ground.scope import CONVOLUTIONS, full_weights
from spikeport.errors import UsageError

VARIABLE = "SPIKEPORT_MEMORY_GB"
"""The environment variable that sets a limit in place of the available memory."""
GB = 1e9
BASE = 4e6
ENSEMBLE, DECODED, PLAIN = 15_000, 35_000, 8_000
"""Bytes of an ensemble, a decoded connection and any other connection, without weights."""
PROBE = 20_000
"""Bytes of a probe, with the connection that decodes for it."""
COMPARTMENT, WEIGHT, SPARSE_WEIGHT = 400, 150, 700
"""Bytes of a neuron, a weight and a sparse matrix's weight, which has a list almost to itself."""
RELAYED, TO_TARGET = 70, 25
"""Bytes of a weight to a neuron that relays decoded values, and of a weight from it."""
EVALUATION, SQUARE = 10, 52
"""Bytes for each evaluation point and neuron in the matrices of activities while decoders are
solved, and of an entry of the square matrix of neurons, or of points if these are fewer."""
DECODE_NEURONS = 20
"""The neurons that relay a dimension from ensemble to ensemble: nengo-loihi's decode neurons."""
KERNELS, PER_KERNEL = 16, 128
"""Copies of a convolution's kernel that are stored: 16, as kernels are cut at borders and by
strides, and one more for every 128 output neurons, as each core has its own."""
CGROUP = Path("/sys/fs/cgroup")


def over_memory(network: nengo.Network) -> list[Violation]:
    """Return a violation if compiling a network takes more memory than is available."""
    needed, limit = estimate(network), available()
    if needed <= limit:
        return []
    used, most = (f"{n / GB:,.1f} GB" for n in (needed, limit))
    return [rules.get("SP501").broken("network", used, most, gb=math.ceil(needed / GB))]


def available() -> float:
    """Return the memory that a compile may take, in bytes.

    This is the value of `VARIABLE`, in GB, if that is set; else the memory left on the machine or
    in the container, whichever is less; infinity if neither is known.
    """
    if text := os.environ.get(VARIABLE):
        return _asked_for(text)
    # The kernel's own estimate of the memory that is available without swapping.
    lines = _text(Path("/proc/meminfo")).splitlines()
    free = [1024 * float(line.split()[1]) for line in lines if line.startswith("MemAvailable:")]
    most, used = (_text(CGROUP / name).strip() for name in ("memory.max", "memory.current"))
    group = []
    if most.isdigit() and used.isdigit():
        # Cached pages of files count as used, but the kernel frees them on demand.
        group.append(float(most) - float(used) + _reclaimable())
    return min([*free, *group], default=math.inf)


def _reclaimable() -> float:
    lines = _text(CGROUP / "memory.stat").splitlines()
    return sum(float(line.split()[1]) for line in lines if line.startswith("inactive_file "))


def _asked_for(text: str) -> float:
    try:
        limit = float(text)
    except ValueError:
        limit = math.nan
    if not 0 < limit < math.inf:
        raise UsageError(f"{VARIABLE}={text}: not a number of GB above 0; cure: {VARIABLE}=8")
    return limit * GB


def _text(path: Path) -> str:
    """Return the text of a system file, or an empty text if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""


def estimate(network: nengo.Network) -> int:
    """Estimate the bytes that compiling a network takes, within a factor of about 2."""
    # An ensemble that several networks list is built once.
    ensembles = dict.fromkeys(network.all_ensembles)
    objects = sum(ENSEMBLE + COMPARTMENT * e.n_neurons for e in ensembles)
    connections = sum(sum(_connection_bytes(c)) for c in dict.fromkeys(network.all_connections))
    solved = max((_solver_bytes(e.n_neurons, points) for e, points in _solved(network)), default=0)
    probes = PROBE * len(set(network.all_probes))
    return int(BASE + objects + connections + probes + solved)


def _connection_bytes(connection: nengo.Connection) -> Iterator[float]:
    """Yield the bytes of a connection's objects, of the neurons it adds, and of its weights."""
    pre, post = connection.pre_obj, connection.post_obj
    if not isinstance(pre, nengo.Ensemble):
        yield PLAIN + (_weight_bytes(connection) if isinstance(post, Neurons) else 0)
        if isinstance(post, nengo.Ensemble):
            yield TO_TARGET * 2 * connection.size_out * post.n_neurons
        return
    if full_weights(connection) and isinstance(post, nengo.Ensemble):
        yield PLAIN + WEIGHT * pre.n_neurons * post.n_neurons
        return
    host = isinstance(post, nengo.Node) and post.output is not None
    relays = (2 if host else DECODE_NEURONS) * connection.size_out
    yield DECODED + COMPARTMENT * relays + RELAYED * relays * pre.n_neurons
    target = base(post)
    if isinstance(target, nengo.Ensemble):
        yield TO_TARGET * 2 * connection.size_out * target.n_neurons


def _weight_bytes(connection: nengo.Connection) -> float:
    """Return the bytes of the weights of a connection to neurons."""
    transform = connection.transform
    if isinstance(transform, CONVOLUTIONS):
        copies = KERNELS + connection.size_out / PER_KERNEL
        return WEIGHT * float(copies * math.prod(transform.kernel_shape))
    if isinstance(transform, nengo.Sparse):
        sparse = transform.init  # Nengo's matrix, or SciPy's
        return SPARSE_WEIGHT * float(sparse.nnz if hasattr(sparse, "nnz") else len(sparse.indices))
    spikes = 1 if isinstance(connection.pre_obj, Neurons) else 2  # the host sends on and off spikes
    init = getattr(transform, "init", 1)
    matrix = isinstance(init, Distribution) or np.ndim(init) > 0
    return WEIGHT * float(spikes * connection.size_mid * (connection.size_out if matrix else 1))


def _solved(network: nengo.Network) -> Iterator[tuple[nengo.Ensemble, int]]:
    """Yield each ensemble whose decoders are solved, and the number of its evaluation points."""
    for connection in network.all_connections:
        pre, points = connection.pre_obj, connection.eval_points
        if isinstance(pre, nengo.Ensemble):
            yield pre, _n_points(pre, pre.eval_points if points is None else points)
    for probe in network.all_probes:
        if isinstance(probe.obj, nengo.Ensemble):
            yield probe.obj, _n_points(probe.obj, probe.obj.eval_points)


def _solver_bytes(neurons: int, points: int) -> int:
    """Return the bytes that solving for decoders takes."""
    return EVALUATION * neurons * points + SQUARE * min(neurons, points) ** 2


def _n_points(ensemble: nengo.Ensemble, points: nengo.dists.Distribution | np.ndarray) -> int:
    """Return the number of evaluation points that Nengo draws, or that the user passes."""
    if not isinstance(points, nengo.dists.Distribution):
        return len(points)
    if ensemble.n_eval_points is not None:
        return int(ensemble.n_eval_points)
    return int(max(np.clip(500 * ensemble.dimensions, 750, 2500), 2 * ensemble.n_neurons))
