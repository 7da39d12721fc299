"""Neuron types of our own: neurons in steps of the chip, and host neurons that feed and read them.

Nengo's types have no filtered current of their own, and clip the voltage at zero. Types of NIR, of
most frameworks and of the chip have a filtered current, and do not clip the voltage at zero.
"""

from typing import ClassVar

import nengo
import numpy as np
from nengo.dists import Choice, Distribution
from nengo.neurons import NeuronType
from nengo.params import IntParam, NdarrayParam

from spikeport.constants import DECAY_UNITS, DT_S
from spikeport.errors import UsageError

UNIT = 64
"""Thresholds and weights are multiples of this."""

MANTISSA = 127
"""The largest weight, in steps of its connection's weights."""

MOST_HELD_STEPS = 52
"""The most steps from an input to its spike: a `SpikeSource` keeps them as bits of a float64."""

REST = Choice([0])


class Integrator(NeuronType):
    r"""Leaky integrators of a filtered current: base of `IntegrateAndFire` and `LeakyIntegrator`.

    .. math:: u \leftarrow (1 - d_u) u + J\,dt, \qquad v \leftarrow (1 - d_v) v + u + l

    Parameters
    ----------
    current_decay, voltage_decay : float or (n,) array
        The shares :math:`d_u`, from above 0 to 1, and :math:`d_v`, from 0 to 1, that a step takes
        away; one for all neurons, or one for each.
    leak : float or (n,) array
        The change of the voltage in a step, :math:`l`.

    Raises
    ------
    UsageError
        If a decay is out of range.
    """

    state: ClassVar[dict[str, Distribution]] = {"current": REST, "voltage": REST}
    current_decay = NdarrayParam("current_decay")
    voltage_decay = NdarrayParam("voltage_decay")
    leak = NdarrayParam("leak")

    def __init__(
        self,
        current_decay: np.ndarray | float = 1.0,
        voltage_decay: np.ndarray | float = 0.0,
        leak: np.ndarray | float = 0.0,
    ) -> None:
        super().__init__()
        _check("current_decay", current_decay, 0, 1, above=True)
        _check("voltage_decay", voltage_decay, 0, 1)
        _check("leak", leak, -np.inf, np.inf)
        self.current_decay, self.voltage_decay, self.leak = current_decay, voltage_decay, leak

    def _integrate(self, charge: np.ndarray, current: np.ndarray, voltage: np.ndarray) -> None:
        current += charge - self.current_decay * current
        voltage += current - self.voltage_decay * voltage + self.leak

    def _per_step(self, x: np.ndarray, gain: np.ndarray, bias: np.ndarray) -> np.ndarray:
        """Return the voltage that a step adds, once the current has settled."""
        charge: np.ndarray = self.current(x, gain, bias) * DT_S
        settled: np.ndarray = charge / self.current_decay + self.leak
        return settled


class IntegrateAndFire(Integrator):
    r"""Integrators that spike where :math:`v > \theta`, and then start from zero.

    The chip computes them in integers, :math:`\theta` in units of its voltage: weights become
    multiples of 64, of 8 bits with a scale for each connection, so that a large threshold keeps
    more of their precision. The voltage has no limits here; on the chip it stays between
    -(2^23 - 1) and 2^23 - 1.

    Parameters
    ----------
    threshold : float or (n,) array
        The threshold :math:`\theta`, in the unit of weights, above 0.
    current_decay, voltage_decay, leak : float or (n,) array
        See `Integrator`; on the chip decays are multiples of 1/4096, a voltage's at most 4095/4096.
    correction : float or (n,) array
        The value that the chip adds to the leak, to make up for the rounding of constant input;
        floating point, which does not round, leaves it out.
    """

    negative = False
    spiking = True
    threshold = NdarrayParam("threshold")
    correction = NdarrayParam("correction")

    def __init__(
        self,
        threshold: np.ndarray | float = 2.0**15,
        current_decay: np.ndarray | float = 1.0,
        voltage_decay: np.ndarray | float = 0.0,
        leak: np.ndarray | float = 0.0,
        correction: np.ndarray | float = 0.0,
    ) -> None:
        super().__init__(current_decay, voltage_decay, leak)
        _check("threshold", threshold, 0, np.inf, above=True)
        _check("correction", correction, -np.inf, np.inf)
        self.threshold, self.correction = threshold, correction

    def step(
        self,
        dt: float,
        J: np.ndarray,
        output: np.ndarray,
        current: np.ndarray,
        voltage: np.ndarray,
    ) -> None:
        """Advance by a step; a spike is 1/dt high."""
        self._integrate(J * dt, current, voltage)
        spiked = voltage > self.threshold
        output[:] = spiked / dt
        voltage[spiked] = 0

    def rates(self, x: np.ndarray, gain: np.ndarray, bias: np.ndarray) -> np.ndarray:
        """Return the rates in Hz that constant input leads to, in steps of 1 ms."""
        drive = self._per_step(x, gain, bias)
        decay = np.maximum(self.voltage_decay, 1e-12)  # a tiny one in place of none
        fires = drive > decay * self.threshold
        share = np.where(fires, decay * self.threshold / np.where(fires, drive, 1), 0)
        with np.errstate(divide="ignore"):
            # A voltage that equals the threshold does not fire yet.
            n_steps = np.floor(np.log1p(-share) / np.log1p(-decay)) + 1
        rates: np.ndarray = fires / (n_steps * DT_S)
        return rates


class LeakyIntegrator(Integrator):
    """Integrators whose output is their voltage: they read spikes, on the host."""

    spiking = False

    def step(
        self,
        dt: float,
        J: np.ndarray,
        output: np.ndarray,
        current: np.ndarray,
        voltage: np.ndarray,
    ) -> None:
        """Advance by a step."""
        self._integrate(J * dt, current, voltage)
        output[:] = voltage

    def rates(self, x: np.ndarray, gain: np.ndarray, bias: np.ndarray) -> np.ndarray:
        """Return the voltages that constant input leads to, in steps of 1 ms."""
        held: np.ndarray = np.maximum(self.voltage_decay, 1e-12)
        voltages: np.ndarray = self._per_step(x, gain, bias) / held
        return voltages


class SpikeSource(NeuronType):
    """Neurons for the host, which spike where their input is above one half.

    Parameters
    ----------
    late : int
        Steps from an input to its spike, up to `MOST_HELD_STEPS`.
    wait : int
        Steps at the beginning without spikes.
    n_steps : int, optional
        Steps after these in which there may be spikes; by default, all.
    """

    negative = False
    spiking = True
    state: ClassVar[dict[str, Distribution]] = {"elapsed": REST, "history": REST}
    late = IntParam("late", low=0, high=MOST_HELD_STEPS)
    wait = IntParam("wait", low=0)
    n_steps = IntParam("n_steps", low=1, optional=True)

    def __init__(self, late: int = 0, wait: int = 0, n_steps: int | None = None) -> None:
        super().__init__()
        self.late, self.wait, self.n_steps = late, wait, n_steps

    def step(
        self,
        dt: float,
        J: np.ndarray,
        output: np.ndarray,
        elapsed: np.ndarray,
        history: np.ndarray,
    ) -> None:
        """Advance by a step."""
        # A number with a bit for each step: the lowest is this step's, the highest makes a spike.
        history[:] = 2 * history % 2.0 ** (self.late + 1) + (J > 0.5)
        end = np.inf if self.n_steps is None else self.wait + self.n_steps
        open_now = (elapsed >= self.wait) & (elapsed < end)
        output[:] = ((history >= 2.0**self.late) & open_now) / dt
        elapsed += 1

    def rates(self, x: np.ndarray, gain: np.ndarray, bias: np.ndarray) -> np.ndarray:
        """Return the rates in Hz, in steps of 1 ms."""
        rates: np.ndarray = (self.current(x, gain, bias) > 0.5) / DT_S
        return rates


def chip_decays(
    current_decay: np.ndarray | float, voltage_decay: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return decays as the chip rounds them, in 1/4096: a current's from 1, a voltage's to 4095."""
    current = np.clip(np.round(np.asarray(current_decay) * DECAY_UNITS), 1, DECAY_UNITS)
    voltage = np.clip(np.floor(np.asarray(voltage_decay) * DECAY_UNITS + 0.5), 0, DECAY_UNITS - 1)
    return current.astype(int), voltage.astype(int)


def weight_step(largest: float) -> float:
    """Return the step of a connection's weights on the chip, by its largest weight, in units."""
    return float(2.0 ** np.ceil(np.log2(max(largest / MANTISSA, UNIT))))


def _check(
    name: str, value: np.ndarray | float, low: float, high: float, above: bool = False
) -> None:
    """Refuse a value out of a range, which begins above its low end or at it."""
    values = np.ravel(value)
    odd = values[~((values > low if above else values >= low) & (values <= high))]
    if odd.size:
        limits = f"is above {low:g}, up to {high:g}" if above else f"goes from {low:g} to {high:g}"
        raise UsageError(f"{name}: {odd[0]:g} is out of range; it {limits}")


OWN_TYPES: tuple[type[nengo.neurons.NeuronType], ...] = (IntegrateAndFire,)
"""Types of ours that the chip computes."""
HOST_TYPES: tuple[type[nengo.neurons.NeuronType], ...] = (LeakyIntegrator, SpikeSource)
"""Types of ours that are for the host, whatever the settings of their ensembles."""
