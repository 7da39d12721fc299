r"""Equations of a node's neurons for one time step: NIR's, discretised by Euler's method.

.. math::
    I &\leftarrow I + \tfrac{dt}{\tau_{syn}} (w_{in} x - I) \\
    v &\leftarrow v + \tfrac{dt}{\tau_{mem}} (v_{leak} - v + R I)

A neuron spikes where :math:`v > v_{thr}`, which sets v to :math:`v_{reset}`. x is a sum of weights,
one for each spike of the step, as in all frameworks. Neurons without a current have I = x; IF has
no time constant, v <- v + R x; a threshold has neither, v = x.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spikeport.networks.loading.nir.graph import Node
from spikeport.networks.loading.nir.operators import SIZE, Shape
from spikeport.reading.mismatch import MismatchError

PARAMETERS = (
    "tau",
    "tau_syn",
    "tau_mem",
    "r",
    "v_leak",
    "v_threshold",
    "v_reset",
    "w_in",
    "threshold",
)
LONGEST = 8192
"""The longest time constant of a current, in steps: the chip has 12 bits for its decay, never 0."""


@dataclass(frozen=True)
class Dynamics:
    """Coefficients of neurons, each (n,); voltages are relative to the reset voltage.

    Attributes
    ----------
    shape : tuple of int
        The shape of the node.
    current_decay, voltage_decay : array
        dt / tau_syn and dt / tau_mem; 1 and 0 where there is no such time constant.
    gain : array
        The change of v by a weight of 1 in the step of a spike.
    leak : array
        The change of v in every step.
    threshold, reset : array
        The threshold, relative to the reset voltage, and that voltage; infinity and 0 of a
        read-out.
    """

    shape: Shape
    current_decay: np.ndarray
    voltage_decay: np.ndarray
    gain: np.ndarray
    leak: np.ndarray
    threshold: np.ndarray
    reset: np.ndarray

    @property
    def size(self) -> int:
        """The number of neurons."""
        return self.gain.size


def own_shape(node: Node) -> Shape:
    """Return the shape of a node's parameters.

    Raises
    ------
    MismatchError
        There is no neuron, or there are too many.
    """
    shapes = {node.numbers(field).shape for field in node.values if field in PARAMETERS}
    # Several shapes may have one size: a shape of one axis counts, or else the first of them.
    shape = max(sorted(shapes, key=lambda one: (len(one) != 1, one)), key=math.prod)
    if not 1 <= math.prod(shape) <= SIZE:
        raise MismatchError(f"from 1 to {SIZE:,} neurons in node {node.name}", f"{shape}")
    return shape


def dynamics(node: Node, shape: Shape, dt_s: float) -> Dynamics:
    """Return the equations of a node of neurons of a shape.

    Raises
    ------
    MismatchError
        A parameter is absent or out of range.
    """
    return _Parameters(node, shape, dt_s).dynamics()


class _Parameters:
    """The parameters of a node, of one shape."""

    def __init__(self, node: Node, shape: Shape, dt_s: float) -> None:
        self._node, self._shape, self._dt_s = node, shape, dt_s

    def dynamics(self) -> Dynamics:
        """Return the equations."""
        current, voltage, gain = DECAYS[self._node.kind](self)
        threshold, reset = self._threshold()
        leak = voltage * (self.get("v_leak", 0) - reset)
        return Dynamics(self._shape, current, voltage, gain, leak, threshold, reset)

    def get(self, field: str, absent: float | None = None) -> np.ndarray:
        """Return a parameter, (n,)."""
        n = math.prod(self._shape)
        if absent is not None and field not in self._node.values:
            return np.full(n, absent)
        value = self._node.numbers(field)
        if value.size in (1, n):
            return np.resize(value, n)
        try:
            return np.broadcast_to(value, self._shape).ravel()
        except ValueError:
            wanted = f"{field} for neurons {self._shape} in node {self._node.name}"
            raise MismatchError(wanted, f"{value.shape}") from None

    def decay(self, field: str) -> np.ndarray:
        """Return dt / tau."""
        tau_s, bounds = self.get(field), f"of at least {self._dt_s:g} s (one step of --dt)"
        if (tau_s <= 0).any():
            raise MismatchError(
                f"{field} above 0 in node {self._node.name}",
                f"{tau_s.min():g} s",
                cure="correct it in the graph: no --dt helps",
            )
        odd = tau_s < self._dt_s * (1 - 1e-6)
        if field == "tau_syn":
            bounds = f"from {self._dt_s:g} s (one step of --dt) to {LONGEST} steps"
            odd |= tau_s > self._dt_s * LONGEST
        if odd.any():
            raise MismatchError(
                f"{field} {bounds} in node {self._node.name}",
                f"{tau_s[odd][0]:g} s",
                cure="give another --dt",
            )
        return np.minimum(self._dt_s / tau_s, 1.0)

    def _threshold(self) -> tuple[np.ndarray, np.ndarray]:
        if self._node.kind in ("LI", "CubaLI"):
            return np.full(math.prod(self._shape), np.inf), self.get("r") * 0
        name = "threshold" if self._node.kind == "Threshold" else "v_threshold"
        reset = self.get("v_reset", 0)
        threshold = self.get(name) - reset
        if threshold.min() <= 0:
            i = threshold.argmin()
            raise MismatchError(
                f"thresholds of node {self._node.name} above its reset voltage",
                f"threshold {self.get(name)[i]:g}, reset voltage {reset[i]:g}",
            )
        return threshold, reset


def _cuba(of: _Parameters) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    current, voltage = of.decay("tau_syn"), of.decay("tau_mem")
    return current, voltage, current * of.get("w_in", 1) * voltage * of.get("r")


def _leaky(of: _Parameters) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    voltage = of.decay("tau")
    return np.ones_like(voltage), voltage, voltage * of.get("r")


def _integrating(of: _Parameters) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    r = of.get("r")
    return np.ones_like(r), np.zeros_like(r), r


def _memoryless(of: _Parameters) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    one = np.ones_like(of.get("threshold"))
    return one, one, one


DECAYS: dict[str, Callable[[_Parameters], tuple[np.ndarray, np.ndarray, np.ndarray]]] = {
    "LIF": _leaky,
    "LI": _leaky,
    "CubaLIF": _cuba,
    "CubaLI": _cuba,
    "IF": _integrating,
    "Threshold": _memoryless,
}
"""Current decay, voltage decay and gain, by the kind of a node."""
