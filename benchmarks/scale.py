"""Compile time, memory and step time of ever larger networks, up to a board of 32 chips.

    OPENBLAS_NUM_THREADS=1 python benchmarks/scale.py [--n N]... [--out FILE] [--figure FILE]

A network of n neurons is a chain of groups of 512. Each neuron has weights to 32 random neurons of
the next group and fires by its bias. The network is compiled in a process of its own, and the image
runs in another, so that each peak of memory belongs to only one of them. ``--n`` chooses the sizes
to measure: by default all, with ``--n 0`` none. Rows of other sizes stay in the file of results;
each names the machine that it was measured on.
The last two columns are wall time of one thread, and of a thread for each processor, in turn.
"""

import argparse
import itertools
import json
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cases
import markdown_table
import nengo
import numpy as np
from arguments import at_least
from boards import board
from matplotlib.figure import Figure
from peak_memory import peak_bytes
from speed import machine
from timing import cpu_us, wall_us

from spikeport.atomic import write_text
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.native.shards import available
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network

RESULTS = Path(__file__).parent / "scale.json"
GROUP, FAN_OUT = 512, 32
SIZES = (4_096, 16_384, 65_536, 131_072, 262_144, 1_048_576)
"""Neurons; 131,072 fill a chip, 1,048,576 a quarter of a board of 32."""
CHIP = 131_072
MEMORY = ("compile_bytes", "run_bytes")
HEADS = (
    *("neurons", "cores", "synapses", "compile, CPU s", "peak of the compile, MB (a synapse)"),
    *("peak of loading and running, MB (a synapse)", "load into kernels, CPU s"),
    *("step, CPU ms", "million events a second", "step, wall ms", "on all processors, wall ms"),
)
PANELS: dict[str, dict[str, tuple[str, float]]] = {
    "CPU time, s": {"compile": ("compile_s", 1), "load into kernels": ("open_s", 1)},
    "peak of memory, GB": {"compile": ("compile_bytes", 1e-9), "run": ("run_bytes", 1e-9)},
    "a step, CPU ms": {"native": ("step_us", 1e-3)},
}
"""The lines of each panel: label, figure and unit."""


def chain(n: int) -> nengo.Network:
    """Return groups of neurons in a chain, n neurons in all."""
    rng = np.random.RandomState(0)
    with nengo.Network(seed=0) as network:
        groups = [
            nengo.Ensemble(GROUP, 1, gain=np.ones(GROUP), bias=rng.uniform(0.9, 1.5, GROUP)).neurons
            for _ in range(n // GROUP)
        ]
        for pre, post in itertools.pairwise(groups):
            weights = cases.scattered(rng, GROUP, FAN_OUT, -1e-3, 1e-3)
            nengo.Connection(pre, post, transform=weights, synapse=0.005)
        nengo.Probe(groups[-1][:1])
    return network


def compiled(n: int, chip: Path, image: Path) -> dict[str, float]:
    """Compile a network, save its image, and return the costs."""
    network = chain(n)
    before, begin = peak_bytes(), time.process_time()
    found = compile_network(network, chip).image
    cpu_s, grown = time.process_time() - begin, peak_bytes() - before
    found.save(image)
    return {
        "neurons": found.n_compartments,
        "cores": found.n_cores,
        "synapses": len(found.synapses.weight),
        "compile_s": cpu_s,
        "compile_bytes": grown,
    }


def run(image: Path, rounds: int) -> dict[str, float]:
    """Load an image, step it, and return the costs."""
    before = peak_bytes()
    loaded = ChipImage.load(image)
    begin = time.process_time()
    chip = NativeChip(loaded, seed=0)
    open_s = time.process_time() - begin
    nothing = np.zeros(0, dtype=np.int64)
    step_us = cpu_us({"step": lambda: chip.step(nothing, {})}, rounds)["step"]
    activity, grown = chip.activity(), peak_bytes() - before
    return {
        "open_s": open_s,
        "run_bytes": grown,
        "step_us": step_us,
        "events": float(activity.synaptic_operations.sum(axis=1).mean()),
        "spikes": float(activity.spikes.sum(axis=1).mean()),
        **_divided(loaded, chip),
    }


def _divided(image: ChipImage, chip: NativeChip) -> dict[str, float]:
    """Return the wall time of a step with one thread, and with one for each processor."""
    others, nothing = NativeChip(image, seed=0, threads=available()), np.zeros(0, dtype=np.int64)
    both = {"wall_us": chip, "threads_wall_us": others}
    found = wall_us({name: partial(one.step, nothing, {}) for name, one in both.items()}, 200)
    others.close()
    return {**found, "threads": available()}


def measure(n: int, rounds: int) -> dict[str, Any]:
    """Compile and run a network, each in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        chip, image = board(Path(folder)), Path(folder) / "image.npz"
        both = {**_apart(compiled, n, chip, image), **_apart(run, image, rounds)}
    return {**both, "machine": machine()}


def _apart(function: Callable[..., dict[str, float]], *arguments: object) -> dict[str, float]:
    with ProcessPoolExecutor(1, get_context("spawn")) as process:
        return process.submit(function, *arguments).result()


def table(sizes: dict[str, dict[str, Any]]) -> str:
    """Return a table of the figures of all sizes."""
    return markdown_table.table(HEADS, [_row(one) for one in sizes.values()])


def _row(one: dict[str, Any]) -> tuple[str, ...]:
    per_synapse = [one[key] / one["synapses"] for key in MEMORY]
    return (
        f"{one['neurons']:,}",
        f"{one['cores']:,}",
        f"{one['synapses']:,}",
        f"{one['compile_s']:,.1f}",
        *(
            f"{one[key] / 1e6:,.0f} ({each:,.0f} B)"
            for key, each in zip(MEMORY, per_synapse, strict=True)
        ),
        f"{one['open_s']:,.1f}",
        f"{one['step_us'] / 1e3:,.2f}",
        f"{one['events'] / one['step_us']:,.0f}",
        *(f"{one[key] / 1e3:,.2f}" if key in one else "" for key in ("wall_us", "threads_wall_us")),
    )


def draw(sizes: dict[str, dict[str, Any]], path: Path) -> None:
    """Draw compile time, memory and step time over the number of neurons."""
    figure = Figure(figsize=(11, 3.4), layout="constrained")
    neurons = [one["neurons"] for one in sizes.values()]
    for axes, (title, lines) in zip(figure.subplots(1, 3), PANELS.items(), strict=True):
        for label, (key, unit) in lines.items():
            axes.loglog(neurons, [one[key] * unit for one in sizes.values()], "o-", label=label)
        axes.set(title=title, xlabel="neurons")
        axes.axvline(CHIP, color="0.7", lw=1, ls=":")
        axes.legend(frameon=False)
    figure.savefig(path, dpi=110)


def size(text: str) -> int:
    """Return a number of neurons, 0 for none; ArgumentTypeError for one that no chain has."""
    n = int(text)
    if n and (n % GROUP or n < 2 * GROUP):
        raise argparse.ArgumentTypeError(f"{n} is no multiple of {GROUP} from {2 * GROUP} on")
    return n


def main() -> None:
    """Measure the chosen sizes; write the results, print a table, draw a figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", action="append", type=size)
    parser.add_argument("--rounds", type=at_least(1), default=5)
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--figure", type=Path)
    arguments = parser.parse_args()
    there = arguments.out.exists()
    sizes = json.loads(arguments.out.read_text(encoding="utf-8")) if there else {}
    for n in filter(None, SIZES if arguments.n is None else arguments.n):
        sizes[str(n)] = measure(n, arguments.rounds)
        print(n, sizes[str(n)], flush=True)
        sizes = dict(sorted(sizes.items(), key=lambda size: int(size[0])))
        write_text(arguments.out, json.dumps(sizes, indent=2) + "\n")
    print(table(sizes))
    if arguments.figure is not None:
        draw(sizes, arguments.figure)


if __name__ == "__main__":
    main()
