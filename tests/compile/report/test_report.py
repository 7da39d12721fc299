from typing import Any

from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.report import in_result


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


def test_a_result_repeats_parts_of_a_report(whole: dict[str, Any]) -> None:
    parts = in_result(whole)
    assert list(parts) == ["image_digest", "resources", "energy", "timing", "host_io"]
    assert all(parts[key] is whole[key] for key in parts)
    assert in_result(None) == dict.fromkeys(parts)
