"""Runs the points of a sweep that are not finished yet, on Dask's workers."""

import itertools
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from distributed import Client, Future, get_worker, wait
from distributed.scheduler import KilledWorker

from spikeport.errors import BackendError, SpikeportError
from spikeport.experiments import registry
from spikeport.experiments.sweep.folder import PointFiles, SweepFolder
from spikeport.experiments.sweep.plan import Point, Sweep
from spikeport.experiments.sweep.workers import workers
from spikeport.files import read_json
from spikeport.progress import Progress

PATIENCE_S = 60
"""How long a sweep waits without any worker: Dask starts those that died anew, most times."""


class Failure(NamedTuple):
    """A point that could not be finished, and why."""

    point: Point
    reason: str


def run(
    sweep: Sweep, folder: SweepFolder, scheduler: str | None, n_workers: int, progress: Progress
) -> list[Failure]:
    """Run what is missing of a sweep; an interrupt leaves what is finished.

    Raises
    ------
    UsageError
        As `spikeport.experiments.sweep.workers.workers`.
    BackendError
        If no worker is left.
    """
    points = sweep.points()
    missing = [point for point in points if not folder.holds(point)]
    if not missing:
        return []
    failures: list[Failure] = []
    progress("starting the workers", None)
    with workers(scheduler, min(n_workers, len(missing))) as client:
        ended = len(points) - len(missing)
        outcomes = _outcomes(client, missing)
        while ended < len(points):
            progress(f"{ended} of {len(points)} points", ended / len(points))
            point, outcome = next(outcomes)
            if isinstance(outcome, PointFiles):
                folder.write(point, outcome)
            else:
                failures.append(Failure(point, outcome))
            ended += 1
    return failures


def _outcomes(client: Client, points: Sequence[Point]) -> Iterator[tuple[Point, PointFiles | str]]:
    """Every point as it ends, with what is kept of it, or why it failed.

    No more are under way than there are workers, lest the next one to kill its worker takes with it
    what that worker has not yet handed over.
    """
    waiting, running = iter(points), dict[Future, Point]()

    def submit() -> None:
        free = len(client.nthreads()) - len(running)
        for point in itertools.islice(waiting, max(1, free)):
            # not pure: Dask must not take another sweep's outcome for that of an equal point
            running[client.submit(run_point, point, pure=False)] = point

    submit()
    while running:
        for future in _ended(client, running):
            yield running.pop(future), _outcome(future)
        submit()


def _ended(client: Client, running: Iterable[Future]) -> Iterable[Future]:
    """Wait some time for one to end, and return those that did; BackendError without workers."""
    try:
        done: Iterable[Future] = wait(
            list(running), timeout=PATIENCE_S, return_when="FIRST_COMPLETED"
        ).done
    except TimeoutError:
        if not client.nthreads():
            raise BackendError(
                "no worker is left, and none came back; cure: run the same command again, it goes "
                "on with what is not finished"
            ) from None
        return ()
    return done


def _outcome(future: Future) -> PointFiles | str:
    error = future.exception()
    if error is None:
        kept: PointFiles = future.result()
        return kept
    if isinstance(error, KilledWorker):
        times = error.allowed_failures + 1
        return f"its worker died {times} times; cure: fewer --workers, if memory ran out"
    return str(error) if isinstance(error, SpikeportError) else repr(error)


def run_point(point: Point) -> PointFiles:
    """Run a point on a worker, in a folder that is removed after it, or with the worker's own."""
    experiment = registry.get(point.sweep.experiment)
    scratch = tempfile.TemporaryDirectory(dir=get_worker().local_directory)
    with scratch as name, warnings.catch_warnings(action="ignore"):
        folder = Path(name)
        experiment.run(experiment.settings(**point.settings), point.options, folder)
        result = read_json(folder / "result.json")
        probes = (folder / "probes.nc").read_bytes() if point.sweep.probes else None
    return PointFiles(result, probes)
