"""The values that a policy is converted from: its layers, the ranges of its units, the options."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spikeport.errors import UsageError, unknown
from spikeport.networks.activations import Activation, activation
from spikeport.networks.option_checks import check_filters, check_pairs, check_rates

WIDEST = 1.75
"""The most by which a unit's least range exceeds its values. The smallest units of the shipped
walking policies, whose values reach 0.295, still have the least range of 0.5."""
UNITS = ("hybrid", "lif", "relu", "if", "bent")
SOLVES = ("unit", "layer")


@dataclass(frozen=True)
class Layer:
    """A dense layer: ``weights`` (n_out, n_in) and ``bias`` (n_out,)."""

    weights: np.ndarray
    bias: np.ndarray


@dataclass(frozen=True)
class Readout(Layer):
    """A layer with separate weights for the halves of the units before it.

    Its ``weights`` are (n_out, n_halves * n): first those of all units for z > 0, then those for
    z < 0, if the activation has neurons there.
    """


@dataclass(frozen=True)
class Calibrated:
    """The changes that a calibration makes to a policy where it runs.

    ``weights`` and ``bias`` are those of a `Readout`; ``trim`` (n_in,) is added to the
    first layer's input.
    """

    weights: np.ndarray
    bias: np.ndarray
    trim: np.ndarray | float = 0.0

    def of(self, layers: Sequence[Layer]) -> list[Layer]:
        """Return the layers of a policy with these changes."""
        first, *others, _ = layers
        trimmed = Layer(first.weights, first.bias + (first.weights * self.trim).sum(axis=1))
        return [trimmed, *others, Readout(self.weights, self.bias)]


@dataclass(frozen=True)
class Ranges:
    """The ranges of the pre-activations of a layer's units, (n,) to either side, both positive."""

    above: np.ndarray
    below: np.ndarray


@dataclass(frozen=True)
class PolicyOptions:
    """The way in which a policy's units become neurons; rates in Hz, time constants in seconds.

    Attributes
    ----------
    n_neurons : int
        Neurons of a unit, half of them for each sign of its pre-activation.
    tau_fwd, tau_out : float
        Low-pass filters between layers, and of the action.
    max_rates : tuple of float
        Firing rates at the end of a unit's range are drawn uniformly from these.
    tau_ref : float
        Refractory period of LIF and IF neurons.
    activation : str
        One of `spikeport.networks.activations.ACTIVATIONS`.
    units : str
        ``hybrid``: spiking rectified linear neurons for z > 0, LIF for z < 0; ``lif``, ``relu``
        or ``if`` (integrate-and-fire with a refractory period): the same neurons for both signs;
        ``bent``: rectified linear neurons for both signs, half of which fire only further out, for
        activations that bend at other places than zero.
    solve : str
        ``unit``: every unit decodes the activation, and the weights stay as they are; ``layer``:
        the weights between two layers are solved for jointly (`spikeport.networks.policy_solving`).
    observes_host : bool
        True if observations come from the host, which then adds large biases of the first layer;
        False if they come from neurons on the chip: then the sums stay on the chip.
    """

    n_neurons: int = 20
    tau_fwd: float = 0.002
    tau_out: float = 0.005
    max_rates: tuple[float, float] = (400.0, 800.0)
    tau_ref: float = 0.001
    activation: str = "elu"
    units: str = "hybrid"
    solve: str = "unit"
    observes_host: bool = True

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        check_pairs("n_neurons", self.n_neurons, "a unit")
        check_filters(tau_fwd=self.tau_fwd, tau_out=self.tau_out)
        check_rates(max_rates=self.max_rates)
        activation(self.activation)
        for key, known in (("units", UNITS), ("solve", SOLVES)):
            if getattr(self, key) not in known:
                raise unknown(key, getattr(self, key), known)

    @property
    def function(self) -> Activation:
        """The activation."""
        return activation(self.activation)


def exact(
    layers: Sequence[Layer], observation: np.ndarray, activation_name: str = "elu"
) -> list[np.ndarray]:
    """Return the pre-activations of all layers for observations; the last ones are the action."""
    function = activation(activation_name).function
    values, found = np.asarray(observation), []
    for layer in layers:
        found.append(values @ layer.weights.T + layer.bias)
        values = function(found[-1])
    return found


def record_ranges(
    layers: Sequence[Layer],
    observations: np.ndarray,
    quantile: float = 0.995,
    floor: float = 0.5,
    activation_name: str = "elu",
) -> list[Ranges]:
    """Return the ranges of all hidden units, for each sign, on observations (n_samples, n).

    The error grows with the range, so the range is a quantile of the values, not their maximum;
    ``floor`` is the least range, for a unit that hardly ever has that sign. Where all values of a
    unit are small, `WIDEST` times their quantile is the least range.

    Raises
    ------
    UsageError
        If the observations are not finite numbers, or not as many a row as the network has inputs.
    """
    check_observations(observations, layers[0].weights.shape[1])
    hidden = exact(layers, observations, activation_name)[:-1]
    return [_ranges(z, quantile, floor) for z in hidden]


def _ranges(z: np.ndarray, quantile: float, floor: float) -> Ranges:
    above, below, either = (np.quantile(one, quantile, axis=0) for one in (z, -z, abs(z)))
    least = np.where(either > 0, np.minimum(WIDEST * either, floor), floor)
    return Ranges(np.maximum(above, least), np.maximum(below, least))


def check_observations(observations: np.ndarray, n_inputs: int) -> None:
    """Raise UsageError if observations are no finite numbers (m, n_inputs)."""
    found = np.asarray(observations)
    if found.ndim != 2 or found.shape[1] != n_inputs or not len(found):
        raise UsageError(
            f"observations of shape {found.shape}, expected (m, {n_inputs}): a row for each, of as "
            "many values as the network has inputs"
        )
    if found.dtype.kind not in "fiu" or not np.isfinite(found).all():
        raise UsageError("observations hold NaN, infinity or no numbers; cure: leave such rows out")
