"""Reading of the report of a compile or run, from a file or a folder."""

from pathlib import Path
from typing import get_type_hints

from pydantic import TypeAdapter, ValidationError

from spikeport.compile.report.report import SCHEMA, Json
from spikeport.compile.report.schema import ReportData
from spikeport.errors import UsageError, printable
from spikeport.experiments.run_folder import RESULT_SCHEMA
from spikeport.files import read_json
from spikeport.reading.mismatch import shown

IN_FOLDERS = ("report.json", "result.json")
OF_RUNS = {"experiment", "model"}
"""Keys of the results of `run` and `simulate`, of which each has one, and a report none."""
NEEDED = ("image_digest", "resources", "energy", "timing")
COMPARED = (*NEEDED, "violations", "basis", "host_io", "passes", "quantisation", "loss")
PARTS: dict[str, TypeAdapter[object]] = {
    name: TypeAdapter(get_type_hints(ReportData)[name]) for name in COMPARED
}
"""The parts of reports that are compared; a run's result has only `NEEDED` and ``host_io``."""


def read(path: Path) -> Json:
    """Return the report in a file, or in the folder of a compile or run.

    Raises
    ------
    UsageError
        If there is no report, or it has another schema.
    """
    file = report_file(path)
    report: Json = read_json(file)
    _check(file, report)
    return report


def run_of(path: Path, report: Json) -> Json | None:
    """Return the result of the run that a report is of; None for a compile."""
    try:
        found = read_json(path / "result.json" if path.is_dir() else path)
    except UsageError:
        return None
    # Another file of this name may be anybody's.
    same = isinstance(found, dict) and found.get("image_digest") == report["image_digest"]
    is_run = same and found.get("schema") == RESULT_SCHEMA and OF_RUNS & found.keys()
    return found if is_run else None


def check_whole(name: str, report: Json) -> None:
    """Refuse a report that is incomplete, like the one in a run's result, or malformed.

    Raises
    ------
    UsageError
        The message names the part that is missing or wrong.
    """
    try:
        ReportData.model_validate(report)
    except ValidationError as error:
        first = error.errors()[0]
        where = printable(".".join(map(str, first["loc"])))
        raise UsageError(
            f"{name}: not the whole report that a page is made of: {where}: "
            f"{printable(first['msg'])}; give a report.json, or a folder with one"
        ) from None


def report_file(path: Path) -> Path:
    """Return the report's file: the path, or the file in this folder; UsageError if none exists."""
    try:
        path.stat()
    except FileNotFoundError:
        raise UsageError(f"{path}: no such file or folder") from None
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}") from None
    if not path.is_dir():
        return path
    found = [path / name for name in IN_FOLDERS if (path / name).is_file()]
    if not found:
        raise UsageError(f"{path}: has neither {' nor '.join(IN_FOLDERS)}")
    return found[0]


def _check(file: Path, report: object) -> None:
    if not isinstance(report, dict) or not set(NEEDED) <= set(report):
        raise UsageError(f"{file}: not a report of a compile, nor of a run")
    known = RESULT_SCHEMA if OF_RUNS & set(report) else SCHEMA
    if report.get("schema") != known:
        raise UsageError(
            f"{file}: report schema {shown(report.get('schema'))}, this spikeport reads {known}; "
            "write it again"
        )
    if report["resources"] is None:
        raise UsageError(
            f"{file}: the run used no chip, and only figures of chips are "
            "compared; give runs on a backend with a chip"
        )
    for name in report.keys() & PARTS.keys():
        try:
            PARTS[name].validate_python(report[name])
        except ValidationError as error:
            reason = printable(error.errors()[0]["msg"])
            raise UsageError(f"{file}: not a report: {name}: {reason}; write it again") from None
