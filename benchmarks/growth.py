"""CPU time, cores and memory of compiling networks of many small parts, and how these grow.

    OPENBLAS_NUM_THREADS=1 python benchmarks/growth.py [--network NAME]... [--n N]...
        [--pipeline NAME]... [--parts]

Each network is compiled in a process of its own, for a board of 32 chips. CPU time is that of the
compile alone; the peak is the growth of memory during it, beside the estimate made before. The last
column is log(CPU / CPU of the row above) / log(n / n of the row above). ``--parts`` adds the CPU
time of each part of the compile, with its own exponent.
"""

import argparse
import math
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import markdown_table
import nengo
import numpy as np
from arguments import at_least
from boards import board
from cases import chain
from peak_memory import peak_bytes

from spikeport.compile.check.memory import estimate
from spikeport.compile.passes.parse import parse
from spikeport.compile.pipeline import compile_network

NEURONS = 5
"""Neurons of an ensemble in the chains of small parts."""
MB = 1e6
Cells = tuple[str, ...]
HEADS = ("network", "n", "pipeline", "CPU s", "cores", "peak MB", "estimate MB", "exponent")


class Row(NamedTuple):
    """CPU time, cores, and memory, in bytes, of one compile; and the CPU time of its parts."""

    cpu_s: float
    cores: int
    peak: float
    estimate: float
    parts: dict[str, float]


def equal(n: int) -> nengo.Network:
    """Return a chain of n equal ensembles."""
    return chain(n, NEURONS, seed=1)


def distinct(n: int) -> nengo.Network:
    """Return a chain of n ensembles, no two of which are equal."""
    return chain(n, NEURONS)


def large(n: int) -> nengo.Network:
    """Return a chain of n ensembles of 500 neurons."""
    return chain(n, 500)


def decoded(n: int) -> nengo.Network:
    """Return n decoded connections between random pairs of n / 50 ensembles of 50 neurons."""
    return between(max(n // 50, 2), n)


def decoded20(n: int) -> nengo.Network:
    """Return n decoded connections between random pairs of 20 ensembles of 50 neurons."""
    return between(20, n)


def between(n_ensembles: int, n: int) -> nengo.Network:
    """Return n decoded connections between random pairs of ensembles of 50 neurons."""
    rng = np.random.RandomState(0)
    with nengo.Network(seed=0) as network:
        ensembles = [nengo.Ensemble(50, 1) for _ in range(n_ensembles)]
        for pre, post in rng.randint(n_ensembles, size=(n, 2)):
            nengo.Connection(ensembles[pre], ensembles[post], transform=0.01, synapse=0.005)
        nengo.Probe(ensembles[-1], synapse=0.01)
    return network


def neurons(n: int) -> nengo.Network:
    """Return n connections between single neurons of n / 100 ensembles of 50, in random pairs."""
    rng, size = np.random.RandomState(0), 50
    with nengo.Network(seed=0) as network:
        ensembles = [nengo.Ensemble(size, 1) for _ in range(max(n // 100, 2))]
        for pre, post in rng.randint(len(ensembles), size=(n, 2)):
            weight = np.eye(size)[:, [rng.randint(size)]] * rng.uniform(1e-3, 1e-2)
            source = ensembles[pre].neurons[rng.randint(size)]
            nengo.Connection(source, ensembles[post].neurons, transform=weight, synapse=0.005)
        nengo.Probe(ensembles[-1], synapse=0.01)
    return network


NETWORKS: dict[str, Callable[[int], nengo.Network]] = {
    make.__name__: make for make in (equal, distinct, large, decoded, decoded20, neurons)
}


def measure(name: str, n: int, pipeline: str, chip: Path) -> Row:
    """Compile one network; to be called in a process of its own."""
    network, passes = NETWORKS[name](n), parse(pipeline)
    before, begin = peak_bytes(), time.process_time()
    estimated = estimate(network)
    stages: list[tuple[str, float]] = []

    def note(what: str, _share: float | None) -> None:
        stages.append((what.removeprefix("compiling: "), time.process_time()))

    image = compile_network(network, chip, pipeline=passes, progress=note).image
    end = time.process_time()
    ends = [*(time_s for _, time_s in stages[1:]), end]
    parts = {name: to - since for (name, since), to in zip(stages, ends, strict=True)}
    return Row(end - begin, image.n_cores, peak_bytes() - before, estimated, parts)


def exponent(growth: float, times: float) -> str:
    """Return the power of n that CPU time grew by, as n grew by a factor."""
    return f"{math.log(growth) / math.log(times):.2f}"


def cells(name: str, pipeline: str, n: int, row: Row, before: tuple[int, Row] | None) -> Cells:
    """Return a row of the table."""
    figures = f"{row.cpu_s:.1f}", f"{row.cores:,}", f"{row.peak / MB:,.0f}"
    power = exponent(row.cpu_s / before[1].cpu_s, n / before[0]) if before else ""
    return (name, f"{n:,}", pipeline, *figures, f"{row.estimate / MB:,.0f}", power)


def of_parts(n: int, row: Row, before: tuple[int, Row] | None) -> Iterator[Cells]:
    """Yield a row of the table for each part that takes a hundredth of the time or more."""
    for part, cpu_s in row.parts.items():
        if cpu_s > 0.01 * row.cpu_s:
            known = before[1].parts.get(part) if before else None
            power = exponent(cpu_s / known, n / before[0]) if before and known else ""
            yield ("", f"{n:,}", part, f"{cpu_s:.2f}", "", "", "", power)


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--network", action="append", choices=sorted(NETWORKS))
    parser.add_argument("--n", action="append", type=at_least(1))
    parser.add_argument("--pipeline", action="append")
    parser.add_argument("--parts", action="store_true")
    arguments = parser.parse_args()
    rows: list[Cells] = []
    with tempfile.TemporaryDirectory() as folder:
        chip = board(Path(folder))
        for name in arguments.network or NETWORKS:
            for pipeline in arguments.pipeline or ("as_written", "compact"):
                before = None
                for n in sorted(set(arguments.n or (125, 500, 2000))):
                    with ProcessPoolExecutor(1, get_context("spawn")) as process:
                        row = process.submit(measure, name, n, pipeline, chip).result()
                    rows.append(cells(name, pipeline, n, row, before))
                    print(*rows[-1], flush=True)
                    rows += of_parts(n, row, before) if arguments.parts else ()
                    before = n, row
    print(markdown_table.table(HEADS, rows))


if __name__ == "__main__":
    main()
