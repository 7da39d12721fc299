"""Power of this machine, and costs of a run on the chip."""

import argparse
import json

import computers
import pytest


def test_a_counter_of_energy_that_begins_again_is_no_negative_power(tmp_path, monkeypatch):
    (tmp_path / "max_energy_range_uj").write_text("999999\n")
    readings = iter([999_000, 1_000])
    monkeypatch.setattr(computers, "RAPL", tmp_path)
    monkeypatch.setattr(computers, "_energy_uj", lambda: next(readings))
    clock = iter([0.0, 2.0, 2.0])
    monkeypatch.setattr(computers.time, "monotonic", lambda: next(clock))
    assert computers.power().watts == pytest.approx(0.001)


def test_a_run_without_synaptic_operations_has_costs():
    none = {"event": "synaptic_operation", "count": 0, "energy": {"value": 0.0}}
    spent = {
        "n_steps": 10,
        "period_s": 0.001,
        "terms": [none],
        "dynamic_run": {"value": 2e-6},
        "static": {"power": {"value": 0.1}},
    }
    found = computers.on_chip({"energy": {computers.CALIBRATION: spent}})
    assert (found.synaptic_operations, found.synaptic_operation_j) == (0.0, 0.0)
    assert found.other_j == pytest.approx(2e-7)


def test_folders_without_a_run_on_a_chip_are_refused(tmp_path):
    with pytest.raises(argparse.ArgumentTypeError, match=r"result\.json"):
        computers.on_a_chip(str(tmp_path))
    for found in ({"experiment": "walk", "energy_by_unit": None}, {"experiment": "other"}):
        (tmp_path / "result.json").write_text(json.dumps(found))
        with pytest.raises(argparse.ArgumentTypeError, match="no run of reach, draw, walk, switch"):
            computers.on_a_chip(str(tmp_path))
    kept = {"experiment": "walk", "energy_by_unit": {"policy": 1e-6}}
    (tmp_path / "result.json").write_text(json.dumps(kept))
    assert computers.on_a_chip(str(tmp_path)) == (tmp_path.name, kept)
