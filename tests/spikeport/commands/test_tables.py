"""Tables that the commands print."""

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.commands.console import Console, ScreenTable
from spikeport.commands.tables import cost_table, host_io_table, loss_table, resource_table
from spikeport.compile.report.loss import Loss, LossPart
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel, get
from spikeport.hardware_models.host_io import HostIoReport, HostTraffic, host_io
from spikeport.hardware_models.limits import Usage
from tests.hardware_models.conftest import figure, toy_data


def test_the_table_of_resources_of_a_full_chip_is_uncut_in_80_columns():
    def used(of, axons, bits):
        return {
            "compartment profiles": Usage(of, "compartment profiles", 1, 1024, ""),
            "out axons": Usage(of, "out axons", axons - 1, axons, ""),
            "synapse bits": Usage(of, "synapse bits", bits - 8192, bits, "bit"),
        }

    report = SimpleNamespace(
        chip=get("loihi"),
        cores=[SimpleNamespace(label=f"core {i}") for i in range(128)],
        resources=lambda: used("chip", 524_288, 128 * 2**20),
        fullest=lambda: used("core 127", 4096, 2**20),
    )
    text = printed(resource_table(report))
    assert "16,383 / 16,384 KiB" in text
    assert "524,287 / 524,288" in text
    assert "…" not in text


def printed(table: ScreenTable) -> str:
    console = Console(width=80)
    with console.capture() as captured:
        console.print(table)
    return captured.get()


def test_costs_stand_in_the_column_of_their_calibration():
    toy = toy_data()
    toy |= {"calibrations": toy["calibrations"][::-1], "clock": figure(100, "ns")}
    by_step, of_core = np.ones((6, 1, 1), dtype=int), np.zeros(1, dtype=int)
    activity = Activity(("a",), 0.001, *by_step, np.zeros((1, 1), dtype=int), of_core, of_core)
    text = printed(cost_table(ChipModel.model_validate(toy), activity))
    cells = [re.split(" {2,}", row.strip()) for row in text.splitlines()]
    assert ["empty", "bench"] in cells
    assert ["cycles, mean and longest", "no public figure", "11 and 11"] in cells


def test_a_loss_of_many_causes_says_how_many_are_left_out():
    part = LossPart("a", "bias", 0.1, 0.1, 0.1)
    for n_parts, expected in ((6, False), (7, True)):
        loss = Loss(9, 0.02, 0.5, 0.1, 0.0, (part,) * n_parts, {}, 0, {})
        text = " ".join(printed(loss_table(loss)).split())
        assert ("the 6 largest of 7 causes; a change in the last bit" in text) == expected
        assert text.count("a: bias") == 6


TRAFFIC = HostTraffic(0.001, 576, 288.0, 0, 84, 436, (104,), 0)


def rows(found: HostIoReport) -> str:
    """Return the rows of the table, one after the other."""
    return " ".join(printed(host_io_table(found)).split())


def test_the_table_of_host_io_has_the_traffic_and_published_figures():
    assert rows(host_io(TRAFFIC, get("loihi"))) == (
        "host I/O of a step spikes in 288.0 expected, of 576 sources "
        "read back 104 words (84 values, 436 spikes), 512 bytes in whole packets "
        "published 8 ms [0.95, 9]: nengo-loihi, pull request 26, issues 51 and 109 [thread] "
        "dt = 1 ms not shown: published steps with host I/O take 0.95 ms to 9 ms"
    )


def test_host_io_of_a_run_has_mean_and_most_spikes():
    found = dataclasses.replace(host_io(TRAFFIC, get("loihi")), counted=True, most_spikes=306)
    assert "spikes in 288.0 on average, 306 at most, of 576 sources read" in rows(found)


@pytest.mark.parametrize("name", ["loihi2", "spinnaker2"])
def test_the_table_of_host_io_says_that_no_figure_is_published(name):
    text = rows(host_io(TRAFFIC, get(name)))
    assert text.endswith("dt = 1 ms not shown: no figure is published")
    assert "bytes" not in text


def test_learning_errors_and_sources_without_a_rate_are_named():
    traffic = dataclasses.replace(TRAFFIC, errors=3, unknown_sources=50)
    text = rows(host_io(traffic, get("loihi")))
    assert "learning errors in 3 values" in text
    assert "576 sources; not counting the spikes of 50 with unknown rates" in text
