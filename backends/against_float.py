"""The distance of a compiled network's probes from those of the network as written, in float.

    error = rms(filtered(recorded) - filtered(recorded in float)) / rms(filtered(recorded in float))

over the decoded values and node outputs that are probed. Both run in closed loop with their hosts:
it holds the cost of passes, of nengo-loihi's filters and relays, and of rounding.
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

NOISE = (nengo.processes.WhiteNoise, nengo.processes.FilteredNoise, nengo.processes.WhiteSignal)
"""Processes of which two runs draw different values, unless they have a seed."""


def error_against_float(
    network: nengo.Network, copy: nengo.Network, loop: HostLoop, n_steps: int, seed: int
) -> float | None:
    """Run a network in float Nengo, and compare it with a run of its image.

    Parameters
    ----------
    network : nengo.Network
        The network as the user wrote it.
    copy : nengo.Network
        A copy of it from before the run (`spikeport.fresh_copy`), which runs in float Nengo.
    loop : HostLoop
        The network as it was compiled, after the run.
    n_steps, seed : int
        The length of that run, and the seed of its host.

    Returns
    -------
    error : float or None
        None where no value is probed, or none was sampled in so few steps, or input is random and
        differs from run to run.

    Raises
    ------
    BackendError
        If a function of the network fails.
    """
    # Copies of probes by probes, in the order in which both were made.
    probes = {
        probe: twin
        for probe, twin in zip(network.all_probes, copy.all_probes, strict=True)
        if _is_value(probe)
    }
    if not probes or any(_is_random(node) for node in network.all_nodes):
        return None
    dt_s = loop.compilation.image.manifest.dt_s
    wanted = _float_run(copy, n_steps, dt_s, seed)
    steps = [probe.sample_every or dt_s for probe in probes]
    ours = _joined([loop.data(probe) for probe in probes], steps)
    exact = _joined([wanted[twin] for twin in probes.values()], steps)
    return relative_rms(ours, exact) if exact.size else None


def _is_value(probe: nengo.Probe) -> bool:
    return probe.attr in ("decoded_output", "output") and not isinstance(probe.obj, Neurons)


def _is_random(node: nengo.Node) -> bool:
    return isinstance(node.output, NOISE) and node.output.seed is None


def _float_run(
    network: nengo.Network, n_steps: int, dt_s: float, seed: int
) -> dict[nengo.Probe, np.ndarray]:
    # With the seeds of the compile: gains, encoders and decoded functions are the same.
    rewrite = Rewrite(network, Names(network))
    simulator = attempt("float Nengo", lambda: float_simulator(rewrite, dt_s, seed, optimize=True))
    with simulator:
        for step in range(n_steps):
            attempt(f"float Nengo: step {step + 1}", simulator.step)
        return {probe: recorded(simulator, probe) for probe in network.all_probes}


def _joined(recorded: list[np.ndarray], steps_s: list[float]) -> np.ndarray:
    """Return what probes recorded, filtered, one after the other."""
    pairs = zip(recorded, steps_s, strict=True)
    return np.concatenate([low_pass(values, step_s).ravel() for values, step_s in pairs])
