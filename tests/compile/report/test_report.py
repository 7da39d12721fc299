import json
from typing import Any

import pytest
from pydantic import ValidationError

from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.expected import Rates, expected_activity
from spikeport.compile.report.loss import Loss, LossPart
from spikeport.compile.report.schema import ReportData, schema

LOSS = Loss(
    n_steps=10,
    tau_s=0.02,
    output_error=0.5,
    floor=0.0,
    parts=(LossPart("a", "bias", 0.1, 0.5, 1.0),),
    aliasing={"a": 0.5, "b": 0.25},
    readout_spikes=3,
    saturated_inputs={"input 0": 0.5},
)


@pytest.fixture
def whole(compiled_chain: Compilation) -> dict[str, Any]:
    """A report with all there can be in one."""
    rates = Rates(100, {"first": 50})
    activity = expected_activity(compiled_chain.image, rates)
    return compiled_chain.report.to_dict(activity, rates, LOSS.to_dict())


def test_reports_follow_the_schema(compiled_chain: Compilation, whole: dict[str, Any]) -> None:
    for report in (compiled_chain.report.to_dict(), whole):
        ReportData.model_validate_json(json.dumps(report), strict=True)


@pytest.mark.parametrize("change", [{"schema": 2}, {"cores": [{}]}, {"more": 1}, {"chip": None}])
def test_what_is_no_report_does_not_follow_it(whole: dict[str, Any], change: dict) -> None:
    with pytest.raises(ValidationError):
        ReportData.model_validate(whole | change)


def test_every_key_of_the_schema_is_in_every_report(compiled_chain: Compilation) -> None:
    assert list(schema()["properties"]) == list(compiled_chain.report.to_dict())


def test_stated_rates_are_in_the_report(whole: dict[str, Any]) -> None:
    stated = {"all": 100, "first": 50}
    assert whole["basis"] == {"n_steps": 1, "dt_s": 0.001, "rates_hz": stated}


def test_a_report_without_activity_has_no_costs(compiled_chain: Compilation) -> None:
    report = compiled_chain.report.to_dict()
    absent = ("basis", "energy", "timing", "loss")
    assert [report[key] for key in absent] == [None] * 4
    assert report["neurobench"]["effective_acs"] is None


def test_cores_have_a_lower_bound(compiled_chain: Compilation) -> None:
    report = compiled_chain.report.to_dict()
    bound = report["resources"]["cores"]["lower_bound"]
    assert bound == report["lower_bound"]["cores"] <= report["resources"]["cores"]["used"]


def test_hints_of_a_loss() -> None:
    assert [str(hint) for hint in LOSS.hints] == [
        "read-outs: SP406 read-out saturation: 3 spikes in 10 steps, limit 0; cure: divide what is "
        "decoded by its full scale, and multiply on the host",
        "a: SP407 rate aliasing: 50 % off; cure: lower the maximum rates, or take a shorter dt",
        "input 0: SP408 input saturation: 50 % of the time; cure: widen the ensemble's radius, or "
        "scale the input down",
    ]
