"""Runs the episodes of an evaluation that are not finished yet."""

import contextlib
from collections.abc import Iterator, Sequence

from spikeport.experiments import registry
from spikeport.experiments.evaluate.episode import run_episode
from spikeport.experiments.evaluate.plan import Evaluation
from spikeport.experiments.sweep import workers
from spikeport.experiments.sweep.folder import PointFiles, SweepFolder
from spikeport.experiments.sweep.plan import Point
from spikeport.experiments.sweep.run import CLUSTER, Failure
from spikeport.experiments.sweep.workers import PointOutcome
from spikeport.progress import Progress


def run(
    evaluation: Evaluation,
    folder: SweepFolder,
    scheduler: str | None,
    n_workers: int,
    progress: Progress,
) -> list[Failure]:
    """Run what is missing; an interrupt leaves what is finished.

    Raises
    ------
    UsageError, BackendError
        As `spikeport.experiments.sweep.cluster.outcomes`.
    MissingExtraError
        A scheduler is asked for, and Dask is absent.
    """
    points = evaluation.points()
    missing = [point for point in points if not folder.holds(point)]
    if not missing:
        return []
    failures: list[Failure] = []
    progress("starting the workers", None)
    with _outcomes(scheduler, min(n_workers, len(missing)), missing) as outcomes:
        for ended, (point, outcome) in enumerate(outcomes, len(points) - len(missing) + 1):
            if isinstance(outcome, PointFiles):
                folder.write(point, outcome)
            else:
                failures.append(Failure(point, outcome))
            progress(f"{ended} of {len(points)} episodes", ended / len(points))
    return failures


def _outcomes(
    scheduler: str | None, n_workers: int, points: Sequence[Point]
) -> contextlib.AbstractContextManager[Iterator[tuple[Point, PointOutcome]]]:
    if scheduler is None:
        return workers.outcomes(n_workers, points, run_episode)
    cluster = registry.imported("--scheduler", CLUSTER, extra="sweep")
    opened: contextlib.AbstractContextManager[Iterator[tuple[Point, PointOutcome]]]
    opened = cluster.outcomes(scheduler, points, run_episode)
    return opened
