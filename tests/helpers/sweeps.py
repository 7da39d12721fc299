"""Sweeps whose points are finished by hand."""

from spikeport.experiments.sweep.folder import PointFiles, SweepFolder
from spikeport.experiments.sweep.plan import Point

VARIED = {"n_neurons": (2, 20), "backend": ("reference", "native")}


def finish(
    folder: SweepFolder, point: Point, probes: bytes | None = None, **metrics: object
) -> None:
    """Write what a point measured, as a worker does."""
    folder.write(point, PointFiles({"metrics": metrics}, probes))
