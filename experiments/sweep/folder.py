"""A sweep's folder: ``sweep.json``, a file for each finished point, ``table.nc``, ``figure.png``.

``sweep.json`` says what was asked for. Every file is there whole or not at all, and a point's
``points/NAME.json`` is written last of all it leaves: what has one is finished.
"""

import dataclasses
import json
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from spikeport.atomic import atomic_path, is_leftover
from spikeport.errors import UsageError
from spikeport.experiments.sweep.plan import Point, Sweep
from spikeport.files import read_json, write_json


class PointFiles(NamedTuple):
    """The files kept of a point: its ``result.json``, and ``probes.nc`` if that is asked for."""

    result: dict[str, Any]
    probes: bytes | None


@dataclasses.dataclass(frozen=True)
class SweepFolder:
    """The folder of a sweep, see `open_folder`."""

    path: Path

    @property
    def plan(self) -> Path:
        """The plan of a sweep."""
        return self.path / "sweep.json"

    def result_path(self, point: Point) -> Path:
        """Return where a finished point's figures are."""
        return self.path / "points" / f"{point.name}.json"

    def probes_path(self, point: Point) -> Path:
        """Return where a finished point's time series are, if they are kept."""
        return self.path / "points" / f"{point.name}.nc"

    def holds(self, point: Point) -> bool:
        """Return whether a point is finished."""
        return self.result_path(point).is_file()

    def write(self, point: Point, kept: PointFiles) -> None:
        """Keep a finished point."""
        if kept.probes is not None:
            with atomic_path(self.probes_path(point)) as temporary:
                temporary.write_bytes(kept.probes)
        write_json(self.result_path(point), kept.result)

    def read(self, point: Point) -> dict[str, Any]:
        """Read the ``result.json`` of a finished point.

        Raises
        ------
        UsageError
            If the file was altered to what is no longer JSON.
        """
        path = self.result_path(point)
        try:
            result: dict[str, Any] = read_json(path)
        except UsageError:
            raise UsageError(f"{path}: holds no result; remove it to run its point again") from None
        return result


def open_folder(out: Path | None, sweep: Sweep) -> SweepFolder:
    """Make the folder of a sweep, or go on with what is there; ``runs/sweep-...`` by default.

    Raises
    ------
    UsageError
        If the folder cannot be made, or holds another sweep or anything else.
    """
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    folder = SweepFolder(out or Path("runs") / f"sweep-{sweep.experiment}-{stamp}")
    try:
        folder.path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder.path}: cannot be made ({error.strerror})") from None
    others = [path for path in folder.path.iterdir() if not is_leftover(path)]
    if others and not folder.plan.is_file():
        raise UsageError(f"{folder.path}: holds something else than a sweep; choose another --out")
    if any(folder.path.glob("points/*.json")):
        _check_same(folder, sweep)
    write_json(folder.plan, dataclasses.asdict(sweep))
    return folder


def _check_same(folder: SweepFolder, sweep: Sweep) -> None:
    try:
        held = read_json(folder.plan)
    except UsageError:
        raise UsageError(f"{folder.plan}: is not JSON; choose another --out") from None
    for key, value in json.loads(json.dumps(dataclasses.asdict(sweep))).items():
        if held.get(key) != value:
            raise UsageError(
                f"{folder.path}: holds a sweep with {key}={json.dumps(held.get(key))}, but this "
                f"one has {json.dumps(value)}; ask for the same, or choose another --out"
            )
