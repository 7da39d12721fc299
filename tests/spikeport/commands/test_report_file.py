"""Reports of compiles and runs, read from files or folders."""

import json

import pytest

from spikeport.commands.report_file import IN_FOLDERS, read
from spikeport.compile.report.report import SCHEMA
from spikeport.errors import UsageError
from spikeport.experiments.run_folder import RESULT_SCHEMA

COMPILE = {"schema": SCHEMA, "image_digest": "a", "resources": {}, "energy": {}, "timing": {}}
RUN = COMPILE | {"schema": RESULT_SCHEMA, "experiment": "reach"}


def refusal(path):
    with pytest.raises(UsageError) as caught:
        read(path)
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "report"), zip(IN_FOLDERS, (COMPILE, RUN), strict=True), ids=IN_FOLDERS
)
def test_a_report_is_read_from_its_file_or_folder(tmp_path, name, report):
    path = tmp_path / name
    path.write_text(json.dumps(report))
    assert read(path) == read(tmp_path) == report


@pytest.mark.parametrize("missing", ["image_digest", "resources", "energy", "timing"])
def test_a_file_that_lacks_a_part_of_a_report_is_refused(tmp_path, missing):
    path = tmp_path / "x.json"
    path.write_text(json.dumps({k: v for k, v in COMPILE.items() if k != missing}))
    assert refusal(path) == f"{path}: not a report of a compile, nor of a run"


@pytest.mark.parametrize(("report", "known"), [(COMPILE, SCHEMA), (RUN, RESULT_SCHEMA)])
@pytest.mark.parametrize(("schema", "text"), [(99, "99"), ("x" * 10**5, "x" * 400 + "...")])
def test_a_report_of_another_schema_is_refused(tmp_path, report, known, schema, text):
    path = tmp_path / "x.json"
    path.write_text(json.dumps(report | {"schema": schema}))
    assert refusal(path) == (
        f"{path}: report schema {text}, this spikeport reads {known}; write it again"
    )


def test_the_report_of_a_run_without_a_chip_is_refused(tmp_path):
    path = tmp_path / "x.json"
    path.write_text(json.dumps(RUN | {"resources": None}))
    assert refusal(path) == (
        f"{path}: the run used no chip, and only figures of chips are compared; give runs on a "
        "backend with a chip"
    )


def test_missing_files_and_files_that_are_not_json_are_refused(tmp_path):
    path = tmp_path / "x.json"
    assert refusal(path) == f"{path}: no such file or folder"
    path.write_text("{")
    assert refusal(path).startswith(f"{path}: not JSON: ")
    assert refusal(tmp_path) == f"{tmp_path}: has neither report.json nor result.json"
    long = tmp_path / ("x" * 300)
    assert refusal(long) == f"{long}: cannot be read: File name too long"
