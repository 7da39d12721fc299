r"""A policy fitted to the spikes of its neurons on their backend: its read-out and its trim.

The read-out is refitted to the spikes of the last hidden layer:

.. math::

    W, b = \arg\min \sum_t |F e_t|^2 + m (\lambda \max F (h - \bar h))^2 |W - W_0|^2,
    \quad e_t = W h_t + b - a(o_{t-k})

``h_t`` is the output of the halves of the last hidden layer's units after the filter of the action,
at the end of the time for which observation ``o_t`` is held. ``a`` is the exact policy, ``W_0`` its
own weights, and ``k`` a delay. The layers before change the values by tuning curves of whole steps,
rounded weights and filters; the read-out corrects this as far as a matrix can. ``F`` is the filter
`emphasise_slow`: noise within a step averages out, but lasting errors throw a robot off its path.

The observations are first those of the exact policy's gait. Then a robot walks on the spikes, and
its observations are added, since a gait of spikes sways in another way than the exact one (Ross et
al. 2011, dataset aggregation). Last, the robot walks straight on, and the policy's input is shifted
by as much as the robot drifted to a side: the trim.

`spikeport.experiments.policy.readout` refits with this module if ``calibrated`` asks for it: the
policy is built with ``Calibrated(**calibrated_policy(...).decoders)``. Decoders, and the settings
they are made for, are a `DecoderCalibration`: `Trial.calibrate` returns one for `spikeport
calibrate`, and `calibration.load` reads it for ``calibrated=FILE``.
"""

import functools
from collections.abc import Callable, Sequence
from contextlib import closing
from typing import NamedTuple

import nengo
import numpy as np
from scipy.ndimage import uniform_filter1d

from spikeport.constants import DT_S
from spikeport.experiments.calibration import Refitted, image_digest_of
from spikeport.experiments.options import Options
from spikeport.experiments.stepping import advance
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
"""Raised by one when the method of this file changes, so that older calibrations are refused."""
HOLD_S = 0.005
"""The time for which an observation is held, as in the closed loop."""
HOLD = round(HOLD_S / DT_S)
"""The same time in steps."""
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
"""Slow errors count this many times as much as fast ones."""

Policy = Callable[[np.ndarray], np.ndarray]
"""A function of an observation that returns an action."""


class Played(NamedTuple):
    """The halves' values for observations, (m, n_halves), and the exact actions, (m, d)."""

    halves: np.ndarray
    wanted: np.ndarray


class Walks(NamedTuple):
    """The walks of a robot on a policy, and the trim that they call for.

    ``observe`` returns the observations (k, n) of such walks, ``trim`` the offset (n,) to add to
    observations so that the robot does not drift.
    """

    observe: Callable[[Policy], np.ndarray]
    trim: Callable[[Policy], np.ndarray]


class _OnceAHold(Skippable):
    """A node's function that is needed in only one step of each held observation.

    Parameters
    ----------
    function : callable
        The function of the node's input, which is empty for a node without one.
    step : int
        The step, from 0 on. A backend that calls the function in other steps only loses time.
    """

    def __init__(self, function: Callable[[np.ndarray], np.ndarray | None], step: int) -> None:
        self._function = function
        # It is called in the first step in any case: before that, Nengo has no value to hold.
        self._left = (step - 1) % HOLD

    def __call__(self, _t: float, values: np.ndarray = NO_INPUT) -> np.ndarray | None:
        return self._function(values)

    def skip(self) -> int:
        left, self._left = self._left, HOLD - 1
        return left


class SpikingHalves:
    """A policy on its backend whose action is the halves of its last hidden layer.

    Parameters
    ----------
    build : callable
        Builds the policy from its argument ``calibrated``.
    n_halves : int
        The number of halves of the last hidden layer's units.
    run : Options
        Chip, backend and pipeline.
    """

    def __init__(self, build: Callable[..., PolicyNetwork], n_halves: int, run: Options) -> None:
        self._run = run
        self._output = np.zeros(n_halves)
        with nengo.Network(label="calibration") as network:
            # With the identity as read-out, the action is the halves themselves, after the action's
            # filter.
            built = build(calibrated=Calibrated(np.eye(n_halves), np.zeros(n_halves)))
            self._held = np.zeros(built.observation.size_in)
            held = _OnceAHold(lambda _: self._held, 0)
            source = nengo.Node(held, size_out=len(self._held))
            nengo.Connection(source, built.observation, synapse=None)
            sink = nengo.Node(_OnceAHold(self._give, HOLD - 1), size_in=n_halves)
            nengo.Connection(built.action, sink, synapse=None)
        self._sim = Simulator(
            network,
            chip=run.chip,
            backend=run.calibrating_backend,
            dt=DT_S,
            pipeline=run.pipeline,
        )
        self.image_digest = image_digest_of(self._sim)

    def close(self) -> None:
        """End the simulation, and let go of it.

        Nengo keeps the function of a node in a table for as long as the node exists. These
        functions refer to this object, and through ``_sim`` to the nodes, so without ``del`` none
        of them would ever be freed.
        """
        self._sim.close()
        del self._sim

    def _give(self, halves: np.ndarray) -> None:
        # Copied: the next step may overwrite the simulator's array.
        self._output = halves.copy()

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Hold an observation, and return the values of the halves (n_halves,) at its end."""
        self._held = observation
        for _ in range(HOLD):  # `run_steps` would watch for Ctrl-C and progress
            advance(self._sim)
        return self._output

    def play(self, observations: np.ndarray) -> np.ndarray:
        """Return the halves (m, n_halves) for observations (m, n), held one after the other."""
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
    """Return ``weights``, ``bias`` and ``trim`` of a `Calibrated`, fitted to the neurons.

    Parameters
    ----------
    layers, ranges, options
        The arguments of `spikeport.networks.policy.policy`.
    observations : (m, n) array
        Observations of the exact policy's gait, each to be held for 5 ms.
    walks : Walks
        The walks of the robot.
    run : Options
        Chip, backend and pipeline on which the neurons are to run.
    seed : int
        The seed of the neurons.
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
        # A first fit walks here, since its gait is close to that of the final fit.
        own = played(walks.observe(by(refit_lagged(nominal, gait))))
        readout = refit_lagged(nominal, gait, own)
        trim = walks.trim(by(readout))
    found = {"weights": readout.weights, "bias": readout.bias, "trim": trim}
    return Refitted(found, halves.image_digest)


def refit_lagged(nominal: Readout, *played: Played) -> Readout:
    """Return the read-out fitted to played observations, for actions `LAG` observations earlier."""
    halves = [emphasise_slow(part.halves[SETTLING + LAG :]) for part in played]
    # Filtered part by part, since values jump from one gait to the next. The walks of a part are
    # joined as well; the few values at their joints are left in.
    wanted = [emphasise_slow(part.wanted[SETTLING:-LAG]) for part in played]
    return refit(nominal, np.concatenate(halves), np.concatenate(wanted))


def emphasise_slow(values: np.ndarray) -> np.ndarray:
    """Lessen the fast part of values (m, n): F x = x_mean + (x - x_mean) / `SLOW`.

    ``x_mean`` is the moving average over `STRIDE` values.
    """
    mean = uniform_filter1d(values, STRIDE, axis=0)
    return np.asarray(mean + (values - mean) / SLOW)
