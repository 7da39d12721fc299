"""The table that compares simulators."""

import peers
import pytest
from peers import table

RESULTS = {
    "machine": {"processor": "a processor", "python": "3.11.7"},
    "absent": {"nest": "no wheel for this Python"},
    "cases": {
        "small": {
            "title": "Two neurons",
            "events": 1_000_000,
            "contestants": {
                "nengo-loihi": {
                    "version": "nengo-loihi 1",
                    "step_s": 0.01,
                    "steps": 100,
                    "spikes": 30,
                    "same": "each",
                },
                "native": {
                    "version": "spikeport 1",
                    "step_s": 0.0001,
                    "steps": 100,
                    "spikes": 30,
                    "same": "each",
                },
                "sanafe": {
                    "version": "SANA-FE 2",
                    "step_s": 0.02,
                    "steps": 100,
                    "spikes": 30,
                    "same": "sum",
                },
                "nengo": {
                    "version": "Nengo 4",
                    "step_s": 0.001,
                    "steps": 100,
                    "spikes": 31,
                    "same": "",
                },
                "brian2": {"failed": "no compiler"},
            },
        }
    },
}


def test_the_fastest_comes_first_with_its_ratios_and_whether_spikes_are_equal() -> None:
    lines = table(RESULTS).splitlines()
    assert lines[0] == "**Two neurons**"
    assert lines[4:8] == [
        "| spikeport 1 | 100 | 100.0 | 100x | 1x | 30, equal, neuron by neuron |",
        "| Nengo 4 | 1,000 | 10.0 | 10x | 0.1x | 31, others |",
        "| nengo-loihi 1 | 10,000 | 1.0 | 1x | 0.01x | 30, equal, neuron by neuron |",
        "| SANA-FE 2 | 20,000 | 0.5 | 0.5x | 0.005x | 30, equal in sum |",
    ]


def test_a_simulator_that_did_not_run_is_named_with_the_reason() -> None:
    lines = table(RESULTS).splitlines()
    assert "Not run: nest (no wheel for this Python)." in lines
    assert "Not run: brian2, Two neurons (no compiler)." in lines


def test_without_nengo_loihi_there_are_no_ratios_to_it() -> None:
    small = RESULTS["cases"]["small"]
    others = {**small["contestants"], "nengo-loihi": {"failed": "no memory"}}
    lines = table({**RESULTS, "cases": {"small": {**small, "contestants": others}}}).splitlines()
    assert "| Nengo 4 | 1,000 | 10.0 | - | 0.1x | 31, others |" in lines
    assert "Not run: nengo-loihi, Two neurons (no memory)." in lines


def test_a_native_run_that_fails_ends_the_contest_before_the_others(monkeypatch):
    asked = []

    def fails(_python, script, *_arguments):
        asked.append(script)
        return {"failed": "no kernels"}

    monkeypatch.setattr(peers, "_run", fails)
    with pytest.raises(SystemExit, match="native, which all others are compared with: no kernels"):
        peers.contest(peers.dense(8), {"nest": peers.SCRIPTS})
    assert asked == ["image"]


def test_events_of_a_second_are_those_of_the_counted_steps():
    """Others than the timed steps: their number differs from simulator to simulator."""
    case = RESULTS["cases"]["small"]
    native = {**case["contestants"]["native"], "steps": 50}
    lines = table({**RESULTS, "cases": {"small": {**case, "contestants": {"native": native}}}})
    assert "| spikeport 1 | 100 | 200.0 | - | 1x |" in lines
