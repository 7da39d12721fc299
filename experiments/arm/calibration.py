r"""Decoders of the torque, refitted to the firing rates of a controller on its backend.

.. math:: D = \arg\min_D |A D - Y|^2 + m (\lambda \max A)^2 |D|^2

``A`` (m, n) are the firing rates of a group in Hz while m random states of its region are held,
``Y`` (m, 4) the term of the exact law there, in N m. Nengo solves decoders for the tuning curves
of neurons that receive the exact state. The refitted decoders also account for the effects of
rounded weights, whole time steps, relays and the other decoders.
"""

import itertools
from typing import NamedTuple

import nengo
import numpy as np

from spikeport.experiments.calibration import Refitted, image_digest_of, play_in
from spikeport.experiments.options import Options
from spikeport.networks.arm import REGULARISATION, ArmNetwork, term_torques
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.region import ArmRegion
from spikeport.simulator import Simulator

METHOD = 1
"""Raised by one when the method of this file changes, so that older calibrations are refused."""
STATES = 1500
SETTLING_STEPS = 35
"""Steps that each state is held: 7 time constants of the slowest filter before the neurons."""
COUNTED_STEPS = 30
SEED = 0
"""The seed that draws the states."""


class HeldStates(NamedTuple):
    """States [q, dq, x] (m, 11) with targets (m, 3), and the terms of the torque there."""

    state: np.ndarray
    target: np.ndarray
    torques: dict[str, np.ndarray]


def draw_states(law: OperationalSpaceLaw, region: ArmRegion, n: int = STATES) -> HeldStates:
    """Return random states of a region, in which all terms of the torque act at once."""
    rng = np.random.RandomState(SEED)
    q = region.q_samples[rng.randint(len(region.q_samples), size=n)]
    dq = region.dq.restore(rng.uniform(-1, 1, (n, 4)))
    # The hand's place follows from the angles: states with another place never occur.
    x = law.arm.batch(q).position
    target = region.x.clip(x + region.error.restore(rng.uniform(-1, 1, (n, 3))))
    return HeldStates(np.hstack([q, dq, x]), target, term_torques(law.terms(q), dq, target - x))


def refit_arm(built: ArmNetwork, held: HeldStates, options: Options, dt_s: float) -> Refitted:
    """Refit decoders (n, 4) in N m per Hz for each group of a controller on a backend."""
    steps = SETTLING_STEPS + COUNTED_STEPS
    with nengo.Network(label="calibration", seed=built.seed) as network:
        network.add(built)
        play_in(built.state, held.state, steps, dt_s)
        play_in(built.target, held.target, steps, dt_s)
        probes = {
            label: [nengo.Probe(ensemble.neurons) for ensemble in group]
            for label, group in built.groups.items()
        }
    with Simulator(
        network,
        chip=options.chip,
        backend=options.calibrating_backend,
        dt=dt_s,
        pipeline=options.pipeline,
    ) as sim:
        rates = _rates(sim, list(itertools.chain(*probes.values())), len(held.state), options)
        digest = image_digest_of(sim)
    solver = nengo.solvers.LstsqL2(reg=REGULARISATION)
    decoders = {
        label: solver(np.hstack([rates[probe] for probe in group]), held.torques[label])[0]
        for label, group in probes.items()
    }
    return Refitted(decoders, digest)


def _rates(
    sim: Simulator, probes: list[nengo.Probe], states: int, options: Options
) -> dict[nengo.Probe, np.ndarray]:
    """Measure firing rates (states, n) in Hz of each probe's neurons while states are held."""
    found: dict[nengo.Probe, list[np.ndarray]] = {probe: [] for probe in probes}
    for state in range(states):
        sim.run_steps(SETTLING_STEPS)
        # Until here, the filters still hold spikes of the state before.
        sim.clear_probes()
        sim.run_steps(COUNTED_STEPS)
        for probe in probes:
            found[probe].append(sim.data[probe].mean(axis=0))
        options.progress("calibrating", state / states)
    return {probe: np.array(rows) for probe, rows in found.items()}
