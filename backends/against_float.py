"""The error of a compiled network's probes against the network as written, run in float Nengo.

    error = rms(filtered(recorded) - filtered(recorded in float)) / rms(filtered(recorded in float))

over the decoded values and node outputs that are probed. Both networks run in closed loop with
their hosts: the error includes the effects of passes, of nengo-loihi's filters and relays, and of
rounding.
"""

import nengo
import numpy as np
from nengo.ensemble import Neurons

from spikeport.backends.attempt import attempt
from spikeport.backends.float_simulator import float_simulator
from spikeport.backends.host_loop import HostLoop
from spikeport.backends.rerun import low_pass
from spikeport.backends.sampling import recorded
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.quantisation import relative_rms
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.errors import BackendError

NOISE = (nengo.processes.WhiteNoise, nengo.processes.FilteredNoise, nengo.processes.WhiteSignal)
"""Processes that draw different values in every run, unless they have a seed."""


def error_against_float(
    network: nengo.Network, copy: nengo.Network, loop: HostLoop, n_steps: int, seed: int
) -> float | None:
    """Run a network in float Nengo, and compare it with a run of its image.

    Parameters
    ----------
    network : nengo.Network
        The network as the user wrote it.
    copy : nengo.Network
        A copy of the network from before the run (`spikeport.fresh_copy`), to run in float Nengo.
    loop : HostLoop
        The compiled network, after its run.
    n_steps, seed : int
        The length of the compiled network's run, and the seed of its host.

    Returns
    -------
    error : float or None
        None if no value is probed, if the run was too short for a sample, if all values are 0 in
        float Nengo, or if a random input differs from run to run.

    Raises
    ------
    BackendError
        If a function of the network fails.
    """
    # Maps each probe to its copy: both networks list their probes in the same order.
    probes = {
        probe: twin
        for probe, twin in zip(network.all_probes, copy.all_probes, strict=True)
        if _is_value(probe)
    }
    inputs = [node.output for node in network.all_nodes]
    noise = [ensemble.noise for ensemble in network.all_ensembles]
    if not probes or any(map(_is_random, [*inputs, *noise])):
        return None
    dt_s = loop.compilation.image.manifest.dt_s
    wanted = _float_run(copy, n_steps, dt_s, seed)
    steps = [max(probe.sample_every or dt_s, dt_s) for probe in probes]
    ours = _joined([loop.data(probe) for probe in probes], steps)
    exact = _joined([wanted[twin] for twin in probes.values()], steps)
    # No error is relative to zero.
    return relative_rms(ours, exact) if exact.any() else None


def _is_value(probe: nengo.Probe) -> bool:
    return probe.attr in ("decoded_output", "output") and not isinstance(probe.obj, Neurons)


def _is_random(process: object) -> bool:
    return isinstance(process, NOISE) and process.seed is None


def _float_run(
    network: nengo.Network, n_steps: int, dt_s: float, seed: int
) -> dict[nengo.Probe, np.ndarray]:
    # With the seeds of the compile, so that gains, encoders and decoded functions are the same.
    rewrite = Rewrite(network, Names(network))
    with _float_simulator(rewrite, dt_s, seed) as simulator:
        for step in range(n_steps):
            attempt(f"float Nengo: step {step + 1}", simulator.step)
        return {probe: recorded(simulator, probe) for probe in network.all_probes}


def _float_simulator(rewrite: Rewrite, dt_s: float, seed: int) -> nengo.Simulator:
    def simulator(optimize: bool) -> nengo.Simulator:
        return attempt("float Nengo", lambda: float_simulator(rewrite, dt_s, seed, optimize, True))

    try:
        return simulator(optimize=True)
    except BackendError:
        # Nengo's optimiser fails for some networks, as with negative steps in slices of neurons.
        return simulator(optimize=False)


def _joined(recorded: list[np.ndarray], steps_s: list[float]) -> np.ndarray:
    """Return the filtered recordings of all probes in one array."""
    pairs = zip(recorded, steps_s, strict=True)
    return np.concatenate([low_pass(values, step_s).ravel() for values, step_s in pairs])
