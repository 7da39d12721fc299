"""Speed of the native backend, nengo-loihi's emulator and float Nengo, in one process.

    OPENBLAS_NUM_THREADS=1 python benchmarks/speed.py [--network NAME]... [--rounds N] [--out FILE]

For each network, it measures the CPU time of a step of the chip alone, fed the same random spikes
of the host, and of the whole simulator with the host in lock-step. nengo-loihi's figures are those
of its own code without our counts; ours include the counts. Both run the same blocks, one per core.
"""

import argparse
import contextlib
import itertools
import json
import platform
import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any
from unittest import mock

import nengo
import nengo_loihi
import numpy as np
from arguments import at_least
from cases import NETWORKS, Case
from timing import cpu_us, read_bytes_per_s

import spikeport
from spikeport.atomic import write_text
from spikeport.backends.chip import Chip
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.compile import pipeline
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import deliveries, row_lengths
from spikeport.compile.loihi.extract import extract
from spikeport.compile.pipeline import Compilation

RESULTS = Path(__file__).parent / "results.json"
PACKAGES = ("spikeport", "nengo", "nengo-loihi", "numpy", "numba")


class Emulator(NengoLoihiChip):
    """nengo-loihi's emulator as its users run it: nothing is counted."""

    def _count(self, spikes: Any) -> None:
        pass


def measure(case: Case, rounds: int) -> dict[str, Any]:
    """Return the figures of one network."""
    network = case.make()
    with timed_extraction() as extract_s, spikeport.Simulator(network) as sim:
        compilation = sim.compilation
        assert compilation is not None  # the native backend compiles
        image = compilation.image
        begin = time.process_time()
        native = NativeChip(image, seed=0)
        open_s = time.process_time() - begin
        return {
            "title": case.title,
            "compartments": image.n_compartments,
            "weights": len(image.synapses.weight),
            "extract_s": extract_s[0],
            "open_s": open_s,
            "chip_us": chips(image, native, rounds),
            **traffic(native, image),
            "simulator_us": simulators(network, sim, compilation, rounds),
        }


@contextlib.contextmanager
def timed_extraction() -> Iterator[list[float]]:
    """Compile even networks too large for one block per core, and time the image's extraction."""
    seconds: list[float] = []

    def timed(*args: Any, **kwargs: Any) -> ChipImage:
        begin = time.process_time()
        image = extract(*args, **kwargs)
        seconds.append(time.process_time() - begin)
        return image

    fits = mock.patch.object(pipeline, "verify", return_value=[])
    with fits, mock.patch.object(pipeline, "extract", timed):
        yield seconds


def chips(image: ChipImage, native: NativeChip, rounds: int) -> dict[str, float]:
    """Return the CPU time of a step of the chip alone."""
    both: dict[str, Chip] = {"nengo-loihi": Emulator(image, seed=0), "native": native}
    return cpu_us({name: stepper(chip, image) for name, chip in both.items()}, rounds)


def stepper(chip: Chip, image: ChipImage) -> Callable[[], object]:
    """Return a step of a chip in which three in ten sources on the host spike."""
    spikes = host_spikes(image)
    return lambda: chip.step(next(spikes), {})


def host_spikes(image: ChipImage) -> Iterator[np.ndarray]:
    """Yield the sources that spike in each step, repeating the same 50 steps."""
    rng = np.random.RandomState(0)
    steps = [np.flatnonzero(rng.rand(image.n_inputs) < 0.3) for _ in range(50)]
    return itertools.cycle(steps)


def traffic(chip: NativeChip, image: ChipImage) -> dict[str, float]:
    """Return the spikes, synaptic events and bytes of distinct weights in a step, on average.

    Also return the bytes of all weights, and the bandwidth of reading that many.
    """
    activity, stored = chip.activity(), len(image.synapses.weight) * chip.bytes_per_weight
    return {
        "spikes": float(activity.spikes.sum(axis=1).mean()),
        "synaptic_events": float(activity.synaptic_operations.sum(axis=1).mean()),
        "distinct_bytes": distinct_weights(chip, image) * chip.bytes_per_weight,
        "stored_bytes": stored,
        "read_bytes_per_s": read_bytes_per_s(stored),
    }


def distinct_weights(chip: NativeChip, image: ChipImage, n_steps: int = 20) -> float:
    """Return the mean number of distinct weights that a step reads.

    Spikes of the host also arrive in the next step.
    """
    paths, of_row = deliveries(image), row_lengths(image)
    row = paths.row * (1 + paths.atom.max(initial=0)) + paths.atom
    n_sources = image.n_compartments + image.n_inputs
    found = []
    for sources in itertools.islice(host_spikes(image), n_steps):
        chip.step(sources, {})
        spiked = np.zeros(n_sources, dtype=bool)
        spiked[: image.n_compartments] = chip.state.spiked
        spiked[image.n_compartments + sources] = True
        _, first = np.unique(row[spiked[paths.source]], return_index=True)
        found.append(of_row[paths.row[spiked[paths.source]][first]].sum())
    return float(np.mean(found))


def simulators(
    network: nengo.Network, native: spikeport.Simulator, compilation: Compilation, rounds: int
) -> dict[str, float]:
    """Return the CPU time of a step of whole simulators."""
    theirs = nengo_loihi_simulator(network, compilation)
    with theirs, nengo.Simulator(network, progress_bar=False) as reference:
        sims = {"nengo-loihi": theirs, "native": native, "nengo": reference}
        return cpu_us({name: sim.step for name, sim in sims.items()}, rounds)


def nengo_loihi_simulator(
    network: nengo.Network, compilation: Compilation
) -> nengo_loihi.Simulator:
    """Return nengo-loihi's own simulator of the blocks that were compiled."""
    model = compilation.model
    model.build = lambda *_args, **_options: None  # already built
    with np.errstate(invalid="ignore"):
        return nengo_loihi.Simulator(
            network, model=model, precompute=False, target="sim", progress_bar=False
        )


def machine() -> dict[str, Any]:
    """Return the machine, and the versions of the packages."""
    info = Path("/proc/cpuinfo")
    names = [line for line in info.read_text().splitlines() if "model name" in line]
    return {
        "processor": names[0].split(":")[1].strip() if names else platform.processor(),
        "python": platform.python_version(),
        **{package: version(package) for package in PACKAGES},
    }


def main() -> None:
    """Measure and write the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--network", action="append", choices=sorted(NETWORKS))
    parser.add_argument("--rounds", type=at_least(1), default=7)
    parser.add_argument("--out", type=Path, default=RESULTS)
    arguments = parser.parse_args()
    if arguments.network and arguments.out == RESULTS:
        parser.error(f"--network: {RESULTS} has all networks; choose another file with --out")
    results: dict[str, Any] = {"machine": machine()}
    chosen = arguments.network or NETWORKS
    results["networks"] = {name: measure(NETWORKS[name], arguments.rounds) for name in chosen}
    write_text(arguments.out, json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
