"""The schema of reports, and reports that follow it."""

import json
from typing import Any

import pytest
from pydantic import ValidationError

from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.schema import ReportData, schema


def test_reports_follow_the_schema(compiled_chain: Compilation, whole: dict[str, Any]) -> None:
    for report in (compiled_chain.report.to_dict(), whole):
        ReportData.model_validate_json(json.dumps(report), strict=True)


@pytest.mark.parametrize("change", [{"schema": 1}, {"cores": [{}]}, {"more": 1}, {"chip": None}])
def test_data_that_is_no_report_does_not_follow_the_schema(
    whole: dict[str, Any], change: dict
) -> None:
    with pytest.raises(ValidationError):
        ReportData.model_validate(whole | change)


def test_a_report_has_every_key_of_the_schema_in_order(compiled_chain: Compilation) -> None:
    assert list(schema()["properties"]) == list(compiled_chain.report.to_dict())
