"""The table that compares simulators."""

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
                    "cpu_s": 1.0,
                    "spikes": 30,
                    "same": "each",
                },
                "native": {"version": "spikeport 1", "cpu_s": 0.01, "spikes": 30, "same": "each"},
                "sanafe": {"version": "SANA-FE 2", "cpu_s": 2.0, "spikes": 30, "same": "sum"},
                "nengo": {"version": "Nengo 4", "cpu_s": 0.1, "spikes": 31, "same": ""},
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
