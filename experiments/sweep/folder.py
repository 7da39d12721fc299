"""A sweep's folder: ``sweep.json``, a file for each finished point, ``table.nc``, ``figure.png``.

``sweep.json`` holds the plan, the versions of spikeport and of the packages that compute, and
digests of the files that the plan names. Every file is written whole or not at all. A point's
``points/NAME.json`` is written after its other files: a point that has one is finished.
"""

import contextlib
import dataclasses
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from spikeport.atomic import atomic_path, check_folder, is_leftover, locked
from spikeport.errors import UsageError
from spikeport.experiments.sweep.plan import Point, Sweep
from spikeport.files import read_json, write_json
from spikeport.reading.mismatch import shown

MOST_METRICS = 100
"""The most metrics of a result: experiments have about twenty, and a figure draws each of them."""


FILES, VARIED, VERSIONS = "files", "varied", "versions"
"""The keys of a plan for the digests of files, the varied settings, and the package versions."""

NONE = "none"
"""Stands for the digest of a file that a plan lacks: a changed schedule may name other files."""

MOST_NUMBERS = 10
"""The most numbers in a row that a message has in full."""


class PointFiles(NamedTuple):
    """The files kept of a point: its ``result.json``, and ``probes.nc`` if it is asked for."""

    result: dict[str, Any]
    probes: bytes | None


@dataclasses.dataclass(frozen=True)
class SweepFolder:
    """The folder of a sweep, see `opened`."""

    path: Path

    @property
    def plan(self) -> Path:
        """The plan of a sweep."""
        return self.path / "sweep.json"

    def result_path(self, point: Point) -> Path:
        """Return the path of a finished point's result."""
        return self.path / "points" / f"{point.name}.json"

    def probes_path(self, point: Point) -> Path:
        """Return the path of a finished point's time series, if they are kept."""
        return self.path / "points" / f"{point.name}.nc"

    def holds(self, point: Point) -> bool:
        """Return whether a point is finished."""
        return self.result_path(point).is_file()

    def write(self, point: Point, kept: PointFiles) -> None:
        """Keep a finished point."""
        if kept.probes is not None:
            with atomic_path(self.probes_path(point)) as temporary:
                temporary.write_bytes(kept.probes)
        # Last: where there is a result, the point counts as finished.
        write_json(self.result_path(point), kept.result)

    def read(self, point: Point) -> dict[str, Any]:
        """Read the ``result.json`` of a finished point.

        Raises
        ------
        UsageError
            If the file was altered and holds no result, or the result of another run.
        """
        path = self.result_path(point)
        cure = "remove it to run its point again"
        try:
            result = read_json(path)
        except UsageError:
            result = None
        if not isinstance(result, dict) or not _is_metrics(result.get("metrics")):
            raise UsageError(f"{path}: holds no result; {cure}")
        for key, asked in _asked(point).items():
            # Compared as JSON, in which a tuple is a list.
            if (found := _part(result, key)) != asked:
                raise UsageError(
                    f"{path}: is of a run with {key}={json.dumps(found)}, but this sweep's has "
                    f"{json.dumps(asked)}; {cure}"
                )
        return result

    def read_finished(self, points: Iterable[Point]) -> list[tuple[Point, dict[str, Any]]]:
        """Read the results of all points that are finished.

        Raises
        ------
        UsageError
            As `read`, with a line for each file.
        """
        found, wrong = [], []
        for point in filter(self.holds, points):
            try:
                found.append((point, self.read(point)))
            except UsageError as error:
                wrong.append(str(error))
        if wrong:
            raise UsageError("\n".join(wrong))
        return found


def _is_metrics(value: object) -> bool:
    """Return whether a value is metrics that a table can hold and a figure can draw."""
    if not isinstance(value, dict) or len(value) > MOST_METRICS:
        return False
    numbers = [number for number in value.values() if isinstance(number, int | float)]
    # An integer of JSON may have any length, and a table holds floats.
    within = all(isinstance(n, float) or abs(n) <= sys.float_info.max for n in numbers)
    return (
        bool(numbers) and within and all(name.isascii() and name.isidentifier() for name in value)
    )


def _asked(point: Point) -> dict[str, Any]:
    """Return the values of its run that a point's result must have, by their dotted keys."""
    options = point.options
    asked: dict[str, Any] = {
        "experiment": point.sweep.experiment,
        "backend": options.backend,
        "seconds": point.seconds,
        "seeds.run": options.seed,
        **{f"settings.{key}": value for key, value in point.settings.items()},
    }
    return _as_json(asked)


def _part(result: object, place: str) -> object:
    for key in place.split("."):
        result = result.get(key) if isinstance(result, dict) else None
    return result


def _as_json(value: dict[str, Any]) -> dict[str, Any]:
    """Return a value as it is after being written and read."""
    read: dict[str, Any] = json.loads(json.dumps(value))
    return read


@contextlib.contextmanager
def opened(out: Path | None, sweep: Sweep) -> Iterator[SweepFolder]:
    """Make the folder of a sweep or an evaluation, or continue an earlier one.

    By default it is ``runs/sweep-...`` or ``runs/evaluation-...``.

    It is locked until the block ends: two sweeps in it would mix their points.

    Raises
    ------
    UsageError
        If the folder cannot be made or locked, or holds another sweep or anything else.
    """
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    folder = SweepFolder(out or Path("runs") / f"{sweep.kind}-{sweep.experiment}-{stamp}")
    check_folder("--out", folder.path, folder.path)
    try:
        # Two that start in the same second must not share a default folder.
        folder.path.mkdir(parents=True, exist_ok=out is not None)
    except FileExistsError:
        raise UsageError(f"{folder.path}: is in use by another {sweep.kind}; give --out") from None
    others = [path for path in folder.path.iterdir() if not is_leftover(path)]
    if others and not folder.plan.is_file():
        raise UsageError(
            f"{folder.path}: holds something other than a sweep or an evaluation; choose another "
            "--out"
        )
    with locked(folder.path):
        if folder.plan.is_file():
            _check_same(folder, sweep)
        _tidy(folder)
        write_json(folder.plan, dataclasses.asdict(sweep))
        yield folder


def _tidy(folder: SweepFolder) -> None:
    """Remove files of points that an interrupted sweep left half written; nobody else writes."""
    for path in (folder.path / "points").glob(".*"):
        if is_leftover(path):
            path.unlink()


def _check_same(folder: SweepFolder, sweep: Sweep) -> None:
    """Refuse a folder with another plan; the error names every difference."""
    try:
        held = read_json(folder.plan)
    except UsageError:
        held = None
    files = held.pop(FILES, {}) if isinstance(held, dict) else None
    if not isinstance(held, dict) or not isinstance(files, dict):
        raise UsageError(f"{folder.plan}: is no plan of a sweep; choose another --out")
    asked = _as_json(dataclasses.asdict(sweep))
    now = asked.pop(FILES)
    held, asked = _by_package(held), _by_package(asked)
    differing = sorted(
        key
        for key in held.keys() | asked
        if held.get(key) != asked.get(key)
        # The order of the varied settings decides the names of the points.
        or (key == VARIED and list(held[key]) != list(asked[key]))
    )
    if differing:
        there, here = (_pairs(plan, differing) for plan in (held, asked))
        raise UsageError(
            f"{folder.path}: was begun with {there}, but this {sweep.kind} has {here}; "
            "go back to the earlier values, or choose another --out"
        )
    _check_files(folder, files, now)


def _by_package(plan: dict[str, Any]) -> dict[str, Any]:
    """Return a plan with a key for each version, so that an error names those that differ."""
    versions = plan.get(VERSIONS)
    if not isinstance(versions, dict):
        return plan
    others = {key: value for key, value in plan.items() if key != VERSIONS}
    return others | {f"{VERSIONS}.{name}": version for name, version in versions.items()}


def _check_files(folder: SweepFolder, then: Mapping[str, object], now: Mapping[str, str]) -> None:
    """Refuse files whose contents have changed since the folder's points were run."""
    changed = [name for name in sorted(then.keys() | now) if then.get(name) != now.get(name)]
    if changed:
        pairs = [(shown(then.get(name, NONE)), now.get(name, NONE)) for name in changed]
        named = ", ".join(
            f"{shown(name)} (digest {before} then, {found} now)"
            for name, (before, found) in zip(changed, pairs, strict=True)
        )
        cure = "put the file back as it was" if len(changed) == 1 else "put these files back"
        raise UsageError(
            f"{folder.path}: was begun with other contents of {named}; {cure}, or choose another "
            "--out"
        )


def _pairs(plan: dict[str, Any], keys: list[str]) -> str:
    return ", ".join(f"{key}={_in_short(plan.get(key))}" for key in keys)


def _in_short(value: object) -> str:
    """Return a value as JSON, without most of the seeds, of which there may be thousands."""
    match value:
        case [int(first), *_, int(last)] if len(value) == last - first + 1 > MOST_NUMBERS:
            if value == list(range(first, last + 1)):
                return f"[{first}, ..., {last}]"
    return json.dumps(value)
