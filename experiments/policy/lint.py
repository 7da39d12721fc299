"""Measurements of the layers of a perceptron converted into spikes, and hints on them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

WIDE = 5.0
"""A range above this many rms pre-activations is too wide; normal values have 2.6."""
FEW = 1.0
"""Spikes of a unit in a time constant; with fewer, its value is mostly noise."""

ACTION_S = 0.02
"""The time from one action of a walking policy to the next."""


@dataclass(frozen=True)
class LayerLint:
    """The measurements of a hidden layer.

    Attributes
    ----------
    name : str
        The name of the layer.
    n_units : int
        The number of its units.
    below, above : float
        The largest pre-activations, below and above 0, that a unit represents.
    spread : float or None
        Range over rms pre-activation, median of the units' halves; None if all of these are 0.
    rate_hz : float
        Mean firing rate of its neurons.
    spikes : float
        Spikes of a unit in the time constant that filters its value.
    tau_s : float
        The time constant that filters a unit's value.
    error : float or None
        Rms difference of spiking from exact values, over the rms exact value; None if that is 0.
    """

    name: str
    n_units: int
    below: float
    above: float
    spread: float | None
    rate_hz: float
    spikes: float
    tau_s: float
    error: float | None


@dataclass(frozen=True)
class ConversionLint:
    """The measurements of a conversion.

    Attributes
    ----------
    layers : tuple of LayerLint
        Hidden layers, in float spikes.
    action_error, chip_error : float or None
        Relative rms error of the action, in float spikes and on the chip; None if all actions
        are 0.
    delay_s : float
        Sum of the time constants from observation to action.
    """

    layers: tuple[LayerLint, ...]
    action_error: float | None
    chip_error: float | None
    delay_s: float

    def hints(self) -> Iterator[str]:
        """Yield a hint for each fault, with its cure."""
        wide = [one for one in self.layers if one.spread is not None and one.spread > WIDE]
        yield from _each(
            "range too wide",
            [(one.name, f"{one.spread:.1f} x rms") for one in wide],
            "record observations of the policy's own task (--observations); the error grows with "
            "the range",
        )
        slow = [one for one in self.layers if one.spikes < FEW]
        yield from _each(
            "rate too low",
            [(one.name, f"{one.spikes:.2g} spikes within one tau") for one in slow],
            "more neurons (--neurons), or, except for the last layer, a longer filter (--tau-fwd)",
        )
        if self.delay_s > ACTION_S:
            delay, action = (f"{1000 * time:g} ms" for time in (self.delay_s, ACTION_S))
            yield (
                f"tau too long: {delay} in total, but an action lasts {action}; cure: a smaller "
                "--tau-fwd"
            )


def _each(what: str, found: Sequence[tuple[str, str]], cure: str) -> Iterator[str]:
    if found:
        where = ", ".join(f"{name} ({value})" for name, value in found)
        yield f"{what}: {where}; cure: {cure}"
