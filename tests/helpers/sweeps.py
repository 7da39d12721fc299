"""Sweeps whose points are finished by hand, or by functions that need no robot."""

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

from spikeport.errors import DivergedError
from spikeport.experiments.sweep.folder import PointFiles, SweepFolder
from spikeport.experiments.sweep.plan import Point

VARIED = {"n_neurons": (2, 20), "backend": ("reference", "native")}

MARKS = "SPIKEPORT_TEST_MARKS"
"""The variable that names the folder in which points leave marks."""


def result(point: Point, **metrics: object) -> dict[str, Any]:
    """Return the result that a run of a point would write, with these metrics."""
    options = point.options
    return {
        "experiment": point.sweep.experiment,
        "backend": options.backend,
        "seconds": options.seconds,
        "seeds": {"run": options.seed},
        "settings": point.settings,
        "metrics": metrics,
    }


def finish(
    folder: SweepFolder, point: Point, probes: bytes | None = None, **metrics: object
) -> None:
    """Write the result of a point, as a worker does."""
    folder.write(point, PointFiles(result(point, **metrics), probes))


def do_as_told(point: Point, _scratch: str) -> PointFiles:
    """Leave a mark, and then behave as the point's `speed` asks."""
    marks = Path(os.environ[MARKS])
    (marks / f"{point.name}-{len(list(marks.iterdir()))}").touch()
    deaths = len(list(marks.glob(f"{point.name}-*")))
    match point.place["speed"]:
        case "dies once" if deaths > 1:
            pass
        case "deadly" | "dies once":
            time.sleep(3)  # Dask gives up a worker that dies before its nanny knows that it started
            os.kill(os.getpid(), signal.SIGKILL)
        case "exits":
            sys.exit(3)
        case "ends":
            os._exit(3)
        case "diverges":
            raise DivergedError("an action is not finite")
        case "waits":
            until = time.monotonic() + 60
            while not (marks / "go on").exists() and time.monotonic() < until:
                time.sleep(0.05)
    return PointFiles(result(point, threads=int(os.environ["OMP_NUM_THREADS"])), None)


def write_path(path: Path, speed_m_s: float) -> None:
    """Write a path that goes straight on for 20 s."""
    rows = "".join(f"{t},{speed_m_s * t},0\n" for t in range(21))
    path.write_text("t_s,x_m,y_m\n" + rows)
