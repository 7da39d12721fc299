r"""Parts of nengo-loihi's builder, replaced: for speed, and for rates of regular spiking neurons.

A builder has several generators of random numbers for each ensemble and connection, and NumPy
collects entropy for each of them before it is seeded.

Decoders are solved for the rates of neurons at thousands of values,

.. math::

    r = \frac{1}{n\,dt}, \quad
    n = \left\lceil \frac{\tau_{ref} + \tau_{rc} \log(1 + 1 / j)}{dt} \right\rceil, \quad
    j = g x + b - 1 > 0

Since ``n`` is a whole number, a logarithm in single precision, which takes a fifth of the time, is
enough unless the period is close to a whole step. Seeds and LIF rates keep nengo-loihi's bits.

The decoders of `nengo.solvers.NoSolver` are known, but nengo-loihi computes rates at all values, to
refuse ensembles that never fire.

The host's neurons that encode n values are an ensemble of n dimensions. Nengo draws evaluation
points for it, which takes the third power of n, though nobody decodes it.

nengo-loihi's rates have the height of a spike as a factor. So have Nengo's, except for the rates of
`nengo.RegularSpiking`: its decoded values are larger by that factor, and here on the chip, too.

Source: nengo-loihi's ``loihi_lif_rates``, ``loihi_regularspiking_rates``.
"""

import contextlib
import functools
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import nengo
import nengo_loihi.neurons
import numpy as np
from nengo import LIF, RegularSpiking
from nengo.exceptions import BuildError
from nengo.solvers import NoSolver
from nengo_loihi.builder import connection, ensemble
from nengo_loihi.decode_neurons import OnOffDecodeNeurons
from nengo_loihi.neurons import (
    discretize_tau_rc,
    discretize_tau_ref,
    loihi_regularspiking_rates,
)
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import DTypeLike

from spikeport.arrays import Floats
from spikeport.compile.loihi.replaced import StandIn, replaced

STRETCH = 2**15
"""Values that are computed together, so that intermediate results stay in a core's cache."""
FEW = 32
"""Number of values at which rates are computed first, if decoders are known."""
LEAST = 1e-20
"""A number below every positive j, which is the difference of a current and 1."""
Solve: TypeAlias = Callable[..., tuple[Floats, dict[str, Any]]]
"""nengo-loihi's ``solve_for_decoders``."""
CLOSE = 1e-5
"""A period this close to a whole step, as a share of the period plus the membrane's time constant,
is computed in double precision; this is over a hundred roundings of single precision."""


class _NoEntropy(ISeedSequence):
    """A dummy seed for a generator that is seeded again at once."""

    def generate_state(self, n_words: int, _dtype: DTypeLike = np.uint32) -> Any:
        # A list: words are read one by one, which takes eight times as long from an array.
        return [0] * n_words


_NO_ENTROPY: Any = _NoEntropy()  # NumPy accepts this kind, but its annotations do not


def random_state(seed: int) -> np.random.RandomState:
    """Return ``numpy.random.RandomState(seed)``, in a twentieth of the time."""
    state = np.random.RandomState(np.random.MT19937(_NO_ENTROPY))
    state.seed(seed)
    return state


def lif_rates(
    neuron_type: LIF,
    x: Floats,
    gain: Floats,
    bias: Floats,
    dt: float,
    amplitude: float | None = None,
) -> Floats:
    """Replace values (n_points, n) by the rates in Hz of LIF neurons on the chip; return them.

    The builder needs the values no longer, and new memory would take more time than the rates.

    Parameters
    ----------
    neuron_type : nengo.LIF
        The type of the neurons.
    x : (n_points, n) array
        The value along each neuron's encoder, in units of the radius; overwritten.
    gain, bias : (n,) array
        The neurons' gains and biases.
    dt : float
        The time step, in seconds.
    amplitude : float, optional
        The height of a spike, by default the type's.
    """
    tau_ref_s = discretize_tau_ref(neuron_type.tau_ref, dt)
    tau_rc_s = discretize_tau_rc(neuron_type.tau_rc, dt)
    amplitude = neuron_type.amplitude if amplitude is None else amplitude
    height = max(1, STRETCH // x.shape[1])
    for first in range(0, len(x), height):
        part = slice(first, first + height)
        j = neuron_type.current(x[part], gain, bias) - 1
        # Computed for neurons at rest, too: masking them takes longer than it saves.
        steps = _steps(np.fmax(j, LEAST), tau_ref_s, tau_rc_s, dt)
        np.multiply((amplitude / dt) / steps, j > 0, out=x[part])
    return x


def _steps(j: Floats, tau_ref_s: float, tau_rc_s: float, dt: float) -> Floats:
    """Return the whole steps from spike to spike, for positive j of any shape."""
    inverse = 1.0 / j
    with np.errstate(invalid="ignore"):  # the discretised time constant may be infinite
        rough = np.log(np.float32(1) + inverse.astype(np.float32))
        rough = np.float32(tau_ref_s / dt) + np.float32(tau_rc_s / dt) * rough
        close = CLOSE * (rough + np.float32(tau_rc_s / dt))
        unsure = ~(np.abs(rough - np.rint(rough)) > close)
    steps: Floats = np.ceil(rough).astype(float)
    steps[unsure] = np.ceil((tau_ref_s + tau_rc_s * np.log1p(inverse[unsure])) / dt)
    # A compartment spikes at most once a step, also if both of its times are rounded to 0 steps.
    return np.maximum(steps, 1, out=steps)


def regular_rates(
    neuron_type: RegularSpiking, x: Floats, gain: Floats, bias: Floats, dt: float
) -> Floats:
    """Return the rates in Hz of `nengo.RegularSpiking` on the chip, without its spikes' height."""
    plain = RegularSpiking(neuron_type.base_type)
    rates: Floats = loihi_regularspiking_rates(plain, x, gain, bias, dt)
    return rates


def quick_solve(
    usual: Solve,
    conn: nengo.Connection,
    gain: Floats,
    bias: Floats,
    x: Floats,
    *arguments: object,
    **named: object,
) -> tuple[Floats, dict[str, Any]]:
    """Return decoders of values ``x`` as the usual function does, sooner if they are known.

    Raises
    ------
    BuildError
        If no neuron fires at any of the values.
    """
    if type(conn.solver) is NoSolver:
        # Most ensembles fire at the first few values already. Rates are written over these.
        with contextlib.suppress(BuildError):
            return usual(conn, gain, bias, x[:FEW].copy(), *arguments, **named)
    return usual(conn, gain, bias, x, *arguments, **named)


def quick_ensemble(
    neurons: OnOffDecodeNeurons, usual: Callable[..., nengo.Ensemble], dim: int, **named: object
) -> nengo.Ensemble:
    """Return the host's neurons for ``dim`` values, with a single evaluation point."""
    encoding = usual(neurons, dim, **named)
    encoding.eval_points = np.zeros((1, dim))
    return encoding


_NUMPY = StandIn(np, random=StandIn(np.random, RandomState=random_state))
_RATES = {
    **nengo_loihi.neurons.loihi_rate_functions,
    LIF: lif_rates,
    RegularSpiking: regular_rates,
}


@contextlib.contextmanager
def quick_builder() -> Iterator[None]:
    """Let nengo-loihi's builder use these parts in the context; the caller holds `notices.TURN`."""
    solve = functools.partial(quick_solve, connection.solve_for_decoders)
    encoding = functools.partialmethod(quick_ensemble, OnOffDecodeNeurons.get_ensemble)
    with (
        replaced(ensemble, "np", _NUMPY),
        replaced(connection, "np", _NUMPY),
        replaced(connection, "solve_for_decoders", solve),
        replaced(nengo_loihi.neurons, "loihi_rate_functions", _RATES),
        replaced(OnOffDecodeNeurons, "get_ensemble", encoding),
    ):
        yield
