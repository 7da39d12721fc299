"""Speed of the backends, side by side in one process: CPU time per step, and ratios.

    OPENBLAS_NUM_THREADS=1 python benchmarks/speed.py [--steps N] [--network NAME]...

For each network: the chip alone (an image fed the same input spikes, on nengo-loihi's emulator and
on the native kernels), and the whole `Simulator` in lock-step with its host, against float Nengo.
The best of several rounds counts, in CPU time of the process.
"""

import argparse
import time
from collections.abc import Callable

import nengo
import numpy as np
from rich.console import Console
from rich.table import Table

import spikeport
from spikeport.backends.chip import Chip
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.compile.image import ChipImage

ROUNDS = 3


def arm_like() -> nengo.Network:
    """8,000 LIF neurons in two 5-D ensembles, decoded to the host, in a closed loop."""
    with nengo.Network(seed=0) as network:
        state = nengo.Node(lambda t, x: np.append(0.5 * np.sin(5 * t) - 0.1 * x, 0.3), size_in=4)
        torque = nengo.Node(lambda _t, x: x, size_in=4)
        nengo.Connection(torque, state, synapse=None)
        for _ in range(2):
            ensemble = nengo.Ensemble(
                4000,
                5,
                max_rates=nengo.dists.Uniform(200, 400),
                intercepts=nengo.dists.Uniform(-1, 0.9),
                n_eval_points=2000,
            )
            nengo.Connection(state, ensemble, synapse=None)
            nengo.Connection(ensemble, torque, function=lambda x: 0.5 * x[:4], synapse=0.01)
    return network


def basal_ganglia() -> nengo.Network:
    """Nengo's basal ganglia and thalamus, three actions."""
    with nengo.Network(seed=0) as network:
        utility = nengo.Node(lambda t: [0.8, 0.4, 0.4] if t % 1 < 0.5 else [0.4, 0.8, 0.4])
        ganglia, thalamus = nengo.networks.BasalGanglia(3), nengo.networks.Thalamus(3)
        chosen = nengo.Node(lambda _t, x: x, size_in=3)
        nengo.Connection(utility, ganglia.input, synapse=None)
        nengo.Connection(ganglia.output, thalamus.input)
        nengo.Connection(thalamus.output, chosen)
    return network


NETWORKS = {f.__name__: f for f in (arm_like, basal_ganglia)}


def cpu_us(step: Callable[[], object], steps: int) -> float:
    """CPU time of a step in microseconds, the best of several rounds."""
    times = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        for _ in range(steps):
            step()
        times.append((time.process_time() - begin) / steps * 1e6)
    return min(times)


def chip_us(load: Callable[[ChipImage, int], Chip], image: ChipImage, steps: int) -> float:
    """CPU time of a chip's step, fed random input spikes."""
    chip, rng = load(image, 0), np.random.RandomState(0)
    spikes = [np.flatnonzero(rng.rand(n) < 0.3) for n in image["input_size"]]
    for _ in range(50):
        chip.step(spikes, {})
    return cpu_us(lambda: chip.step(spikes, {}), steps)


def simulator_us(network: nengo.Network, backend: str, steps: int) -> float:
    """CPU time of a whole simulator's step."""
    with spikeport.Simulator(network, backend=backend) as sim:
        sim.run_steps(50)
        return cpu_us(sim.step, steps)


def float_us(network: nengo.Network, steps: int) -> float:
    """CPU time of plain Nengo's step."""
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run_steps(50)
        return cpu_us(sim.step, steps)


def measure(make: Callable[[], nengo.Network], steps: int) -> list[str]:
    """The figures of one network, as a row of the table."""
    network = make()
    image = spikeport.compile_network(network).image
    few = max(1, steps // 50)
    chip = chip_us(NengoLoihiChip, image, few), chip_us(NativeChip, image, steps)
    whole = (simulator_us(network, b, n) for b, n in (("nengo-loihi", few), ("native", steps)))
    loihi, native = whole
    nengo_float = float_us(network, steps)
    return [
        *(f"{t:,.0f}" for t in chip),
        f"{chip[0] / chip[1]:.0f}x",
        f"{loihi:,.0f}",
        f"{native:,.0f}",
        f"{loihi / native:.0f}x",
        f"{nengo_float:,.0f}",
        f"{nengo_float / native:.1f}x",
    ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--network", action="append", choices=sorted(NETWORKS))
    arguments = parser.parse_args()
    table = Table("us of CPU per step", title="chip alone | whole simulator | float Nengo")
    for name in ("nengo-loihi", "native", "ratio", "nengo-loihi", "native", "ratio", "nengo", ""):
        table.add_column(name, justify="right")
    for name in arguments.network or NETWORKS:
        table.add_row(name, *measure(NETWORKS[name], arguments.steps))
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
