"""NIR's equations in plain NumPy, node by node, written to be read, and without spikeport.

Within a step each node takes the sum of the outputs of the nodes before it; a node that is reached
again while it waits for its own input returns its output of the step before. With ``chip``, the
graph runs as an exported image has to: each edge into neurons takes a step, decays have 12 bits and
round towards zero, and metadata hold the limits of a voltage.
"""

import nir
import numpy as np

CURRENT = (nir.CubaLIF, nir.CubaLI)
LEAKY = (*CURRENT, nir.LIF, nir.LI)
NEURONS = (*LEAKY, nir.IF, nir.Threshold)


class Referee:
    """A graph at rest."""

    def __init__(self, graph: nir.NIRGraph, dt: float, chip: bool = False) -> None:
        self.graph, self.dt, self.chip = graph, dt, chip
        self.before = {name: [a for a, b in graph.edges if b == name] for name in graph.nodes}
        self.state = {k: [0.0, 0.0, 0] for k, n in graph.nodes.items() if isinstance(n, NEURONS)}
        self.last = {name: 0.0 * size_of(graph.nodes[name]) for name in self.state}

    def run(self, inputs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the output of each node of neurons in every step: spikes, or voltages."""
        found = {name: [] for name in self.state}
        for step in range(len(next(iter(inputs.values())))):
            self.now = {name: rows[step] for name, rows in inputs.items()}
            self.waiting = set(self.state) if self.chip else set()
            if self.chip:
                nothing = {name: 0 * row for name, row in self.now.items()}
                self.now, self.sent = getattr(self, "sent", nothing), self.now
            new = {name: self._neurons(name) for name in self.state}
            for name, value in new.items():
                found[name].append(np.ravel(value))
            self.last = new
        return {name: np.array(rows) for name, rows in found.items()}

    def _value(self, name: str) -> np.ndarray:
        if name in self.now:
            return self.now[name]
        if name in self.waiting:
            return self.last[name]
        if name in self.state:
            return self._neurons(name)
        return linear(self.graph.nodes[name], self._input(name))

    def _input(self, name: str) -> np.ndarray:
        return sum((np.asarray(self._value(one)) for one in self.before[name]), 0.0)

    def _neurons(self, name: str) -> np.ndarray:
        if name in self.now:
            return self.now[name]
        self.waiting.add(name)
        x = self._input(name)
        if not self.chip:
            self.waiting.discard(name)
        value = self._update(self.graph.nodes[name], self.state[name], x)
        if not self.chip:
            self.now[name] = value
        return value

    def _update(self, node: nir.NIRNode, state: list, x: np.ndarray) -> np.ndarray:
        current, v, rest = state
        if isinstance(node, nir.Threshold):
            return (x > node.threshold).astype(float)
        if isinstance(node, CURRENT):
            share = self.dt / node.tau_syn
            current = self._decayed(current, share) + share * node.w_in * x
        else:
            current = x
        if isinstance(node, LEAKY):
            share = self.dt / getattr(node, "tau_mem", getattr(node, "tau", None))
            v = self._decayed(v, share) + share * (node.v_leak + node.r * current)
        else:
            v = v + node.r * current
        if self.chip:
            v = np.clip(np.round(v), node.metadata["v_min"], node.metadata["v_max"])
            v = np.where(np.asarray(rest) > 0, 0, v)
        spiked = v > getattr(node, "v_threshold", np.inf)
        waits = np.asarray(node.metadata.get("rest_steps", 0)) if self.chip else 0
        rest = np.where(spiked, waits, np.maximum(np.asarray(rest) - 1, 0))
        state[:] = current, np.where(spiked, getattr(node, "v_reset", 0), v), rest
        return v if isinstance(node, nir.LI | nir.CubaLI) else spiked.astype(float)

    def _decayed(self, value: np.ndarray, share: np.ndarray) -> np.ndarray:
        if not self.chip:
            return value * (1 - share)
        kept = np.round(4096 * (1 - share)).astype(np.int64)
        whole = np.round(value).astype(np.int64)
        return np.sign(whole) * (np.abs(whole) * kept >> 12)


def size_of(node: nir.NIRNode) -> np.ndarray:
    """Return an array of the node's shape."""
    return node.threshold if isinstance(node, nir.Threshold) else node.r


def linear(node: nir.NIRNode, x: np.ndarray) -> np.ndarray:
    """Return the output of a linear node."""
    if isinstance(node, nir.Affine | nir.Linear):
        return node.weight @ np.ravel(x) + getattr(node, "bias", 0.0)
    if isinstance(node, nir.Scale):
        return node.scale * x
    if isinstance(node, nir.Flatten):
        return np.ravel(x)
    if isinstance(node, nir.SumPool2d):
        return pooled(x, *(np.ravel(n) for n in (node.kernel_size, node.stride)))
    if isinstance(node, nir.Delay):
        return x  # the delay is one step, which the chip takes anyway
    raise NotImplementedError(type(node).__name__)


def pooled(x: np.ndarray, kernel: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Return the sums of windows, (channels, rows, columns)."""
    rows, columns = (
        range(0, n - k + 1, s) for n, k, s in zip(x.shape[1:], kernel, stride, strict=True)
    )
    windows = [[x[:, i : i + kernel[0], j : j + kernel[1]] for j in columns] for i in rows]
    return np.array([[w.sum(axis=(1, 2)) for w in row] for row in windows]).transpose(2, 0, 1)
