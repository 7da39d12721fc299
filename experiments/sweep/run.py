"""The run of all points of a sweep or an evaluation that are not finished yet."""

import contextlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from spikeport.experiments import registry
from spikeport.experiments.sweep import workers
from spikeport.experiments.sweep.folder import PointFiles, SweepFolder
from spikeport.experiments.sweep.inputs import Unchanged
from spikeport.experiments.sweep.plan import Point
from spikeport.experiments.sweep.workers import PointOutcome, Run
from spikeport.progress import Progress

CLUSTER = "spikeport.experiments.sweep.cluster"
"""The module that needs Dask; it is imported when a scheduler is asked for."""


class Failure(NamedTuple):
    """A point that could not be finished, and why."""

    point: Point
    reason: str


def run(
    points: Sequence[Point],
    run_point: Run,
    folder: SweepFolder,
    scheduler: str | None,
    n_workers: int,
    progress: Progress,
    counted: str = "points",
) -> list[Failure]:
    """Run the points that a folder lacks; an interrupt keeps the finished ones.

    Parameters
    ----------
    points : sequence of Point
        Points of the plan, finished or not.
    run_point : callable
        Runs a point in a worker.
    folder : SweepFolder
        The folder that keeps their files.
    scheduler : str or None
        The address of a Dask cluster; None for processes on this machine.
    n_workers : int
        The number of processes on this machine.
    progress : Progress
        Called with the number of points that have ended.
    counted : str
        The word for points in its messages.

    Raises
    ------
    UsageError, BackendError
        As `spikeport.experiments.sweep.cluster.outcomes`.
    MissingExtraError
        If a scheduler is asked for, and Dask is absent.
    """
    # An interrupted sweep goes on with the missing points.
    missing = [point for point in points if not folder.holds(point)]
    if not missing:
        return []
    failures: list[Failure] = []
    progress("starting the workers", None)
    checked = Unchanged(run_point)
    with _outcomes(missing, checked, scheduler, min(n_workers, len(missing))) as outcomes:
        for ended in range(len(points) - len(missing), len(points)):
            progress(f"{ended} of {len(points)} {counted}", ended / len(points))
            point, outcome = next(outcomes)
            if isinstance(outcome, PointFiles):
                folder.write(point, outcome)
            else:
                failures.append(Failure(point, outcome))
        progress(f"{len(points)} of {len(points)} {counted}", 1.0)
    return failures


def _outcomes(
    points: Sequence[Point], run_point: Run, scheduler: str | None, n_workers: int
) -> contextlib.AbstractContextManager[Iterator[tuple[Point, PointOutcome]]]:
    if scheduler is None:
        return workers.outcomes(n_workers, points, run_point)
    cluster = registry.imported("--scheduler", CLUSTER, extra="sweep")
    opened: contextlib.AbstractContextManager[Iterator[tuple[Point, PointOutcome]]]
    opened = cluster.outcomes(scheduler, points, run_point)
    return opened
