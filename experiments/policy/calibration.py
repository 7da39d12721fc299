r"""The read-out of a policy, refitted to the spikes of its last hidden layer where it runs.

.. math:: W, b = \arg\min \sum_t |W h_t + b - a(o_{t-k})|^2 + m (\lambda \max h)^2 |W - W_0|^2

``h_t`` is what the halves of the last hidden layer's units give after the filter of the action, at
the end of the time for which observation ``o_t`` is held, ``a`` the exact policy, ``W_0`` its own
weights, and ``k`` a delay. Whatever the layers before do to the values, by tuning curves of whole
steps, rounded weights and filters, the read-out corrects as far as a matrix can.

`experiments.walk.controller` refits with this where ``calibrated=true`` is set: the policy is
built with ``readout=Readout(**calibrated_readout(...).decoders)``. Decoders, and what they are made
for, are a `experiments.calibration.Calibration`: ``EXPERIMENT.calibrate`` of `experiments.walk`
returns one for `spikeport calibrate`, and `calibration.load` reads it for ``calibrated=FILE``.
"""

import functools
from collections.abc import Callable, Sequence

import nengo
import numpy as np

from spikeport.experiments.calibration import Refitted, hold
from spikeport.experiments.on_chip import digest_of
from spikeport.experiments.options import Options
from spikeport.networks.policy import (
    Layer,
    PolicyNetwork,
    PolicyOptions,
    Ranges,
    Readout,
    exact,
    policy,
)
from spikeport.networks.policy_solving import by_halves, refit
from spikeport.simulator import Simulator

HOLD_S = 0.005
"""For how long an observation is held, as in the closed loop."""
SETTLING = 20
"""Observations at the start that are not used."""
LAG = 1
"""Observations from the one an action is for to the one at whose end it is given. The filters of
spikes delay by more, and a read-out that looks ahead errs more: by an eighth for each observation.
But a robot whose policy is late turns less than it is told: by 5 % for 10 ms."""
DT_S = 0.001


def calibrated_readout(
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    options: PolicyOptions,
    observations: np.ndarray,
    run: Options,
    seed: int = 0,
) -> Refitted:
    """``weights`` and ``bias`` of a `Readout`, refitted where the neurons run.

    Parameters
    ----------
    layers, ranges, options, seed
        Those of the policy, as `spikeport.networks.policy.policy` takes them.
    observations : (m, n) array
        Recorded observations, each to be held for 5 ms.
    run : Options
        Chip, backend and pipeline on which the neurons are to run.
    """
    build = functools.partial(policy, layers, ranges, options, seed, observations=observations)
    nominal = by_halves(layers[-1], options)
    halves, digest = record_halves(build, nominal.weights.shape[1], observations, run)
    wanted = exact(layers, observations, options.activation)[-1]
    readout = refit_lagged(nominal, halves, wanted)
    return Refitted({"weights": readout.weights, "bias": readout.bias}, digest)


def refit_lagged(nominal: Readout, halves: np.ndarray, wanted: np.ndarray) -> Readout:
    """The read-out of recorded halves (m, n) for actions (m, d) of `LAG` observations before."""
    return refit(nominal, halves[SETTLING + LAG :], wanted[SETTLING:-LAG])


def record_halves(
    build: Callable[..., PolicyNetwork], n_halves: int, observations: np.ndarray, run: Options
) -> tuple[np.ndarray, str]:
    """Play observations (m, n) to a policy whose action is the halves of its last hidden layer.

    Returns these (m, n_halves), at the end of each observation, and the image's digest.
    """
    steps = round(HOLD_S / DT_S)
    with nengo.Network(label="calibration") as network:
        built = build(readout=Readout(np.eye(n_halves), np.zeros(n_halves)))
        hold(built.observation, observations, steps, DT_S)
        probe = nengo.Probe(built.action)
    with Simulator(
        network, chip=run.chip, backend=run.backend, dt=DT_S, pipeline=run.pipeline
    ) as sim:
        for number in range(len(observations)):
            sim.run_steps(steps)
            if number % 50 == 0:
                run.progress("calibrating", number / len(observations))
        return sim.data[probe][steps - 1 :: steps], digest_of(sim)
