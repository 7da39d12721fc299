"""CPU time of a sweep's points, and of single runs of the same points.

    OPENBLAS_NUM_THREADS=1 python benchmarks/sweep_points.py [--n-neurons N]... [--seconds S]
        [--calibrated]

A single run compiles its network, and writes its figure and report. A worker of a sweep reuses its
last network, and writes what a sweep keeps. Both take turns, point by point: with a network for
each point, and with seeds that share a network, which the first one compiles. Gaits and
calibrations are in a cache of the benchmark, filled before; compiles are removed from it.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import markdown_table
from arguments import at_least

from spikeport import cache
from spikeport.experiments import registry
from spikeport.experiments.sweep.plan import Point, Sweep
from spikeport.experiments.sweep.point import KEEPER, PointRun

HEADS = ("points", "n", "single runs, CPU s", "a worker of a sweep, CPU s", "ratio")
SEEDS = (0, 1, 2)


def sweep(n_neurons: int, seconds: float, calibrated: bool, **settings: object) -> Sweep:
    """Return a sweep of walks on the loop, with some seeds."""
    fixed = {"path": "loop", "calibrated": calibrated, "n_neurons": n_neurons, **settings}
    return Sweep("walk", "native", "loihi", "compact", seconds, fixed, {}, SEEDS)


def single(point: Point, folder: Path) -> None:
    """Run a point as `spikeport run` does."""
    experiment = registry.get(point.sweep.experiment)
    options = replace(point.options, cache=cache.of_user())
    experiment.run(experiment.settings(**point.settings), options, folder / "single")


def seconds_of(function: Callable[[], object]) -> float:
    """Return the CPU time of a call without cached compiles, as both sides compile the same."""
    for entry in cache.of_user().entries():
        if entry.kind == "compile":
            entry.path.unlink()
    begin = time.process_time()
    function()
    return time.process_time() - begin


def compare(points: list[Point], folder: Path) -> tuple[float, float]:
    """Return the CPU time of points, as single runs and as points of a sweep, in turn."""
    run, singly, together = PointRun.new(), 0.0, 0.0
    for point in points:
        together += seconds_of(lambda point=point: run(point, str(folder)))  # type: ignore[misc]
        singly += seconds_of(lambda point=point: single(point, folder))  # type: ignore[misc]
    KEEPER.drop()
    return singly, together


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n-neurons", action="append", type=at_least(1))
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--calibrated", action="store_true")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ[cache.FOLDER] = str(folder / "cache")
        for n_neurons in arguments.n_neurons or (2, 20):
            asked = n_neurons, arguments.seconds, arguments.calibrated
            own, shared = sweep(*asked).points(), sweep(*asked, network_seed=0).points()
            for title, points in (("network of its own", own[1:2]), ("one network", shared)):
                single(points[0], folder)  # gait, calibration, kernels
                singly, together = compare(points, folder)
                cells = f"{singly:.1f}", f"{together:.1f}", f"{singly / together:.1f}"
                rows.append((f"N = {n_neurons}, {title}", str(len(points)), *cells))
                print(*rows[-1], flush=True)
    print(markdown_table.table(HEADS, rows))


if __name__ == "__main__":
    main()
