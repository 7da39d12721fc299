r"""A policy fitted to what its neurons do where they run: its read-out, and how it is trimmed.

The read-out is refitted to the spikes of the last hidden layer:

.. math::

    W, b = \arg\min \sum_t |F e_t|^2 + m (\lambda \max F h)^2 |W - W_0|^2,
    \quad e_t = W h_t + b - a(o_{t-k})

``h_t`` is what the halves of the last hidden layer's units give after the filter of the action, at
the end of the time for which observation ``o_t`` is held, ``a`` the exact policy, ``W_0`` its own
weights, and ``k`` a delay. Whatever the layers before do to the values, by tuning curves of whole
steps, rounded weights and filters, the read-out corrects as far as a matrix can. ``F`` is the
filter `emphasise_slow`: noise within a step averages out, what lasts throws a robot off its path.

The observations are those of the exact policy's gait first; then a robot walks on the spikes, and
what it observes is added, since a gait of spikes sways otherwise than the exact one (Ross et al.
2011, dataset aggregation). Last, the robot walks straight on, and its policy's input is moved by as
much as it drifted to a side: the trim.

`experiments.policy.readout` refits with this where ``calibrated`` asks for it: the policy is built
with ``Calibrated(**calibrated_policy(...).decoders)``. Decoders, and what they are made for, are a
`DecoderCalibration`: `Trial.calibrate` returns one for `spikeport calibrate`, and
`calibration.load` reads it for ``calibrated=FILE``.
"""

import functools
from collections.abc import Callable, Sequence
from contextlib import closing
from typing import NamedTuple

import nengo
import numpy as np
from scipy.ndimage import uniform_filter1d

from spikeport.constants import DT_S
from spikeport.experiments.calibration import Refitted, digest_of
from spikeport.experiments.options import Options
from spikeport.networks.policy import (
    Calibrated,
    Layer,
    PolicyNetwork,
    PolicyOptions,
    Ranges,
    Readout,
    exact,
    policy,
)
from spikeport.networks.policy_solving import by_halves, refit
from spikeport.node_functions import NO_INPUT, Skippable
from spikeport.simulator import Simulator

METHOD = 2
"""One more whenever this file refits otherwise: a calibration kept from before is then refused."""
HOLD_S = 0.005
"""For how long an observation is held, as in the closed loop."""
HOLD = round(HOLD_S / DT_S)
"""The same in steps."""
SETTLING = 20
"""Observations at the start that are not used."""
LAG = 1
"""The lag of the fitted action, in observations: at the end of observation t, the read-out gives
the exact action for observation t - LAG. The filters of spikes delay by more, so the read-out has
to predict, and each observation of prediction raises its error by an eighth. But a robot whose
policy is late turns less than commanded: by 5 % for 10 ms."""

STRIDE = 100
"""Observations over which an error is slow, 0.5 s: two steps of a gait."""
SLOW = 12.0
"""Slow errors count for so many times the fast ones."""

Policy = Callable[[np.ndarray], np.ndarray]
"""An action for an observation."""


class Played(NamedTuple):
    """The halves' values for observations, (m, n_halves), and the exact actions, (m, d)."""

    halves: np.ndarray
    wanted: np.ndarray


class Walks(NamedTuple):
    """The walks of a robot by a policy, and the trim that they call for.

    ``observe`` gives (k, n) observations as they will be, ``trim`` what is to be added to them,
    (n,), for the robot not to drift.
    """

    observe: Callable[[Policy], np.ndarray]
    trim: Callable[[Policy], np.ndarray]


class _OnceAHold(Skippable):
    """A node's function that is needed in one step of every hold.

    Parameters
    ----------
    function : callable
        The function of the node's input; a node without one has an empty input.
    step : int
        The step, from 0 on. A backend that calls it in others loses time, and nothing else.
    """

    def __init__(self, function: Callable[[np.ndarray], np.ndarray | None], step: int) -> None:
        self._function = function
        # The first step is called in any case: Nengo has no value before.
        self._left = (step - 1) % HOLD

    def __call__(self, _t: float, values: np.ndarray = NO_INPUT) -> np.ndarray | None:
        return self._function(values)

    def skip(self) -> int:
        left, self._left = self._left, HOLD - 1
        return left


class SpikingHalves:
    """A policy on its backend, whose action is the halves of its last hidden layer.

    Parameters
    ----------
    build : callable
        Makes the policy, from its argument ``calibrated``.
    n_halves : int
        Halves of the last hidden layer's units.
    run : Options
        Chip, backend and pipeline.
    """

    def __init__(self, build: Callable[..., PolicyNetwork], n_halves: int, run: Options) -> None:
        self._run = run
        self._output = np.zeros(n_halves)
        with nengo.Network(label="calibration") as network:
            # The identity as read-out: the action then is the halves themselves, behind the
            # action's filter.
            built = build(calibrated=Calibrated(np.eye(n_halves), np.zeros(n_halves)))
            self._held = np.zeros(built.observation.size_in)
            held = _OnceAHold(lambda _: self._held, 0)
            source = nengo.Node(held, size_out=len(self._held))
            nengo.Connection(source, built.observation, synapse=None)
            sink = nengo.Node(_OnceAHold(self._give, HOLD - 1), size_in=n_halves)
            nengo.Connection(built.action, sink, synapse=None)
        # what the other backend with a chip does, native does bit for bit, and faster
        backend = "reference" if run.backend == "reference" else "native"
        self._sim = Simulator(
            network, chip=run.chip, backend=backend, dt=DT_S, pipeline=run.pipeline
        )
        self.image_digest = digest_of(self._sim)

    def close(self) -> None:
        """End the simulation, and let go of it.

        Nengo keeps the function of a node in a table for as long as the node exists. These
        functions refer to this object, and through ``_sim`` to the nodes, so without ``del`` none
        of them would ever be freed.
        """
        self._sim.close()
        del self._sim

    def _give(self, halves: np.ndarray) -> None:
        # Nengo's own array, which the next step overwrites.
        self._output = halves.copy()

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Return (n_halves,) at the end of the time for which an observation is held."""
        self._held = observation
        for _ in range(HOLD):  # `run_steps` would watch for Ctrl-C and progress
            self._sim.step()
        return self._output

    def play(self, observations: np.ndarray) -> np.ndarray:
        """Return (m, n_halves) for observations (m, n), one after the other."""
        found = []
        for number, observation in enumerate(observations):
            found.append(self(observation))
            if number % 50 == 0:
                self._run.progress("calibrating", number / len(observations))
        return np.array(found)


def calibrated_policy(
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    options: PolicyOptions,
    observations: np.ndarray,
    walks: Walks,
    run: Options,
    seed: int = 0,
) -> Refitted:
    """Return ``weights``, ``bias`` and ``trim`` of a `Calibrated`, from what the neurons do.

    Parameters
    ----------
    layers, ranges, options, seed
        The arguments of `spikeport.networks.policy.policy`.
    observations : (m, n) array
        Observations of the exact policy's gait, each to be held for 5 ms.
    walks : Walks
        The walks of the robot.
    run : Options
        Chip, backend and pipeline on which the neurons are to run.
    """
    build = functools.partial(policy, layers, ranges, options, seed, observations=observations)
    nominal = by_halves(layers[-1], options)
    with closing(SpikingHalves(build, nominal.weights.shape[1], run)) as halves:

        def played(observations: np.ndarray) -> Played:
            return Played(
                halves.play(observations), exact(layers, observations, options.activation)[-1]
            )

        def by(readout: Readout) -> Policy:
            run.progress("walking on the refitted read-out", None)
            return lambda observation: readout.weights @ halves(observation) + readout.bias

        gait = played(observations)
        # Walked by a first fit, whose gait is close to that of the final one.
        own = played(walks.observe(by(refit_lagged(nominal, gait))))
        readout = refit_lagged(nominal, gait, own)
        trim = walks.trim(by(readout))
    found = {"weights": readout.weights, "bias": readout.bias, "trim": trim}
    return Refitted(found, halves.image_digest)


def refit_lagged(nominal: Readout, *played: Played) -> Readout:
    """Return the read-out of played observations, for actions of `LAG` observations before."""
    halves = [emphasise_slow(part.halves[SETTLING + LAG :]) for part in played]
    # Filtered part by part: from one gait to the next, values jump.
    wanted = [emphasise_slow(part.wanted[SETTLING:-LAG]) for part in played]
    return refit(nominal, np.concatenate(halves), np.concatenate(wanted))


def emphasise_slow(values: np.ndarray) -> np.ndarray:
    """Lessen the fast part of values (m, n): F x = x_mean + (x - x_mean) / `SLOW`.

    ``x_mean`` is the moving average over `STRIDE` values.
    """
    mean = uniform_filter1d(values, STRIDE, axis=0)
    return np.asarray(mean + (values - mean) / SLOW)
