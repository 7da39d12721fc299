"""Host input and output: the traffic of a step, and a verdict in words."""

import dataclasses
import json
from typing import Any

import pytest

from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.host_io import HostIoReport, HostTraffic, host_io
from tests.hardware_models.conftest import figure, toy_data

TRAFFIC = HostTraffic(
    dt_s=0.001,
    sources=10,
    spikes=4.5,
    unknown_sources=1,
    values_back=60,
    spikes_back=40,
    words_back=(63,),
    errors=2,
)


def chip_with(**host_io: Any) -> ChipModel:
    return ChipModel.model_validate(toy_data() | {"host_io": host_io})


def step(value: float, low: float | None = None, high: float | None = None) -> dict[str, Any]:
    return {"step": figure(value, "ms", low, high)}


@pytest.mark.parametrize(
    ("published", "verdict", "reason"),
    [
        (step(0.5, 0.1, 1.0), "shown", "published steps with host I/O take 1 ms at most"),
        (step(0.5, None, 0.9), "shown", "published steps with host I/O take 0.9 ms at most"),
        (step(8, 0.95, 9), "not shown", "published steps with host I/O take 0.95 ms to 9 ms"),
        (step(0.5, 0.1), "not shown", "published steps with host I/O take 0.5 ms"),
        (step(8, None, 9), "not shown", "published steps with host I/O take 8 ms"),
        (step(8, 1.0, 9), "not shown", "published steps with host I/O take 1 ms to 9 ms"),
        (step(8, 1.1, 9), "excluded", "published steps with host I/O take 1.1 ms at least"),
        (step(8, 1.1), "excluded", "published steps with host I/O take 1.1 ms at least"),
    ],
)
def test_a_step_is_shown_by_the_worst_published_time_and_excluded_by_the_best(
    published, verdict, reason
):
    found = host_io(TRAFFIC, chip_with(**published))
    assert (found.verdict, found.reason) == (verdict, reason)


def test_a_longer_step_is_shown_on_loihi_and_a_shorter_one_excluded():
    loihi = chips.get("loihi")
    verdicts = {
        dt_s: host_io(dataclasses.replace(TRAFFIC, dt_s=dt_s), loihi).verdict
        for dt_s in (0.0005, 0.001, 0.01)
    }
    assert verdicts == {0.0005: "excluded", 0.001: "not shown", 0.01: "shown"}


@pytest.mark.parametrize("name", ["loihi2", "spinnaker2"])
def test_without_a_figure_nothing_is_shown(name):
    found = host_io(TRAFFIC, chips.get(name))
    assert (found.verdict, found.reason) == ("not shown", "no figure is published")
    assert found.published is None
    assert found.bytes_back is None


def test_a_network_without_host_traffic_needs_no_figure():
    alone = HostTraffic(0.001, 0, 0.0, 0, 0, 0, (), 0)
    found = host_io(alone, chip_with(**step(8, 1.1)))
    assert (found.verdict, found.reason) == ("shown", "nothing crosses between host and chip")


@pytest.mark.parametrize(
    ("words", "n_bytes"), [((63,), 256), ((64,), 256), ((65,), 512), ((1, 3), 512), ((), 0)]
)
def test_words_come_back_in_whole_packets(words, n_bytes):
    traffic = dataclasses.replace(TRAFFIC, words_back=words)
    assert host_io(traffic, chips.get("loihi")).bytes_back == n_bytes


def test_spikes_are_expected_before_a_run_and_counted_in_one(make_activity):
    before = host_io(TRAFFIC, chips.get("loihi"))
    assert (before.counted, before.spikes, before.most_spikes) == (False, 4.5, None)
    ran = host_io(TRAFFIC, chips.get("loihi"), make_activity(host_spikes=[3, 6]))
    assert (ran.counted, ran.spikes, ran.most_spikes) == (True, 4.5, 6)
    stated = make_activity(n_steps=1, host_spikes=[2.5])
    found = host_io(TRAFFIC, chips.get("loihi"), stated, "all rates")
    assert (found.counted, found.spikes, found.most_spikes) == (False, 2.5, None)
    of_others = host_io(TRAFFIC, chips.get("loihi"), stated, "rates on the chip")
    rows = [dict(one.rows())["spikes in"] for one in (before, found, of_others)]
    assert rows == [
        "4.5 expected, of 10 sources; not counting the spikes of 1 with unknown rates",
        "2.5 expected, of 10 sources",
        "2.5 expected, of 10 sources; not counting the spikes of 1 with unknown rates",
    ]


def test_counts_of_one_have_a_singular():
    one = HostTraffic(0.001, 1, 0.5, 0, 1, 1, (1,), 1)
    rows = dict(host_io(one, chips.get("loihi2")).rows())
    assert rows["spikes in"] == "0.5 expected, of 1 source"
    assert rows["read back"] == "1 word (1 value, 1 spike)"
    assert rows["learning errors in"] == "1 value"


@pytest.mark.parametrize("name", chips.names())
def test_a_report_is_read_back_from_its_plain_data(name):
    found = host_io(TRAFFIC, chips.get(name))
    assert HostIoReport.of(json.loads(json.dumps(found.to_dict()))) == found
