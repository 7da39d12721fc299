"""The points of a sweep or an evaluation: their workers, their run and their failures."""

from collections.abc import Iterable

from spikeport.commands.console import line_console
from spikeport.commands.ending import resumable
from spikeport.commands.options import Workers
from spikeport.commands.progress import progress_bar
from spikeport.errors import UsageError
from spikeport.experiments.sweep import run as execution
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import Sweep
from spikeport.experiments.sweep.run import Failure
from spikeport.experiments.sweep.workers import Run


def check_workers(workers: Workers) -> None:
    """Refuse processes beside a cluster, and print the risk of a cluster without certificates."""
    scheduler = workers.scheduler
    if scheduler is None:
        return
    if workers.n is not None:
        raise UsageError(
            f"--workers {workers.n}: a cluster has workers of its own; leave it out, or leave "
            "--scheduler out"
        )
    if not scheduler.startswith("tls://"):
        line_console(stderr=True).print(
            f"note: --scheduler {scheduler}: anyone who can reach this cluster can run code on "
            "it, and on this machine as you; only the cluster's own security protects it. "
            "tls://... asks both sides for certificates.",
        )


def run_points(
    sweep: Sweep, run_point: Run, folder: SweepFolder, workers: Workers, parts: str
) -> list[Failure]:
    """Run the points that a folder lacks, called ``parts`` in messages, and return the failed."""
    with resumable(folder.path, parts), progress_bar() as progress:
        return execution.run(
            sweep.points(),
            run_point,
            folder,
            workers.scheduler,
            workers.n_processes,
            progress,
            parts,
        )


def print_failures(failures: Iterable[Failure]) -> None:
    """Print the points that failed, with the reasons."""
    console = line_console()
    for point, reason in failures:
        console.print(f"failed: {point.name}: {reason}")
