"""Runs the points of a sweep that are not finished yet."""

import contextlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from spikeport.experiments import registry
from spikeport.experiments.sweep import workers
from spikeport.experiments.sweep.folder import PointFiles, SweepFolder
from spikeport.experiments.sweep.plan import Point, Sweep
from spikeport.experiments.sweep.point import PointRun
from spikeport.experiments.sweep.workers import PointOutcome
from spikeport.progress import Progress

CLUSTER = "spikeport.experiments.sweep.cluster"
"""The module that needs Dask; it is imported when a scheduler is asked for."""


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
    UsageError, BackendError
        As `spikeport.experiments.sweep.cluster.outcomes`.
    MissingExtraError
        A scheduler is asked for, and Dask is absent.
    """
    points = sweep.points()
    # A sweep that was interrupted goes on with these.
    missing = [point for point in points if not folder.holds(point)]
    if not missing:
        return []
    failures: list[Failure] = []
    progress("starting the workers", None)
    with _outcomes(scheduler, min(n_workers, len(missing)), missing) as outcomes:
        ended = len(points) - len(missing)
        while ended < len(points):
            progress(f"{ended} of {len(points)} points", ended / len(points))
            point, outcome = next(outcomes)
            if isinstance(outcome, PointFiles):
                folder.write(point, outcome)
            else:
                failures.append(Failure(point, outcome))
            ended += 1
    return failures


def _outcomes(
    scheduler: str | None, n_workers: int, points: Sequence[Point]
) -> contextlib.AbstractContextManager[Iterator[tuple[Point, PointOutcome]]]:
    run_point = PointRun.new()
    if scheduler is None:
        return workers.outcomes(n_workers, points, run_point)
    cluster = registry.imported("--scheduler", CLUSTER, extra="sweep")
    opened: contextlib.AbstractContextManager[Iterator[tuple[Point, PointOutcome]]]
    opened = cluster.outcomes(scheduler, points, run_point)
    return opened
