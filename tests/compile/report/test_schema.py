"""The schema of reports, and reports that follow it."""

import json
from typing import Any

import pytest
from pydantic import ValidationError

from spikeport.compile.check.violation import Violation
from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.report import Report
from spikeport.compile.report.schema import ReportData, schema
from spikeport.hardware_models import chip as chips


@pytest.fixture
def reports(compiled_chain: Compilation, whole: dict[str, Any]) -> list[dict[str, Any]]:
    """Return reports without and with costs and losses, and one on a network that does not fit."""
    broken = Violation("SP002", "neuron type", "a", "Tanh", "LIF", "choose one")
    refused = Report(chips.get("loihi"), "", (), (), (), violations=(broken,))
    return [compiled_chain.report.to_dict(), whole, refused.to_dict()]


def test_reports_follow_the_schema(reports: list[dict[str, Any]]) -> None:
    for report in reports:
        ReportData.model_validate_json(json.dumps(report), strict=True)


@pytest.mark.parametrize("change", [{"schema": 1}, {"cores": [{}]}, {"more": 1}, {"chip": None}])
def test_data_that_is_no_report_does_not_follow_the_schema(
    whole: dict[str, Any], change: dict
) -> None:
    with pytest.raises(ValidationError):
        ReportData.model_validate(whole | change)


def test_reports_have_every_key_of_the_schema_in_order(reports: list[dict[str, Any]]) -> None:
    for report in reports:
        assert list(report) == list(schema()["properties"])
