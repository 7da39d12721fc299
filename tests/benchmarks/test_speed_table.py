"""The table of the benchmark's results."""

import json

import table as benchmark
from cases import NETWORKS
from markdown_table import BEGIN, END, insert
from table import table

RESULTS = {
    "machine": {"processor": "a processor", "python": "3.11.7", "numpy": "2.4.6"},
    "networks": {
        "small": {
            "title": "Two neurons",
            "weights": 1234,
            "extract_s": 0.51,
            "open_s": 1.02,
            "chip_us": {"nengo-loihi": 4000.0, "native": 20.0},
            "simulator_us": {"nengo-loihi": 5000.0, "native": 50.0, "nengo": 125.0},
            "spikes": 300.4,
            "synaptic_events": 20000.0,
            "distinct_bytes": 20000.0,
            "stored_bytes": 2.5e6,
            "read_bytes_per_s": 10e9,
        }
    },
}


def test_the_table_has_times_ratios_and_the_distance_to_the_bandwidth() -> None:
    lines = table(RESULTS).splitlines()
    assert lines[2] == "| Two neurons | 4,000 | 20 | 200x | 5,000 | 50 | 100x | 125 | 2.5x |"
    assert lines[6] == (
        "| Two neurons | 300 | 20,000 | 1,000 million | 1.00 GB/s | 10 % of 10 GB/s (2.5 MB) |"
    )
    assert lines[8:] == [
        "a processor, one thread; python 3.11.7, numpy 2.4.6. An image of 1,234 "
        "weights is extracted in 0.5 s and opened in 1.0 s."
    ]


def test_every_row_of_a_table_has_the_same_number_of_cells() -> None:
    lines = table(RESULTS).splitlines()
    for block in (lines[0:3], lines[4:7]):
        assert len({line.count("|") for line in block}) == 1


def test_text_between_the_markers_is_replaced() -> None:
    text = f"before\n{BEGIN}\nold\n{END}\nafter\n"
    assert insert(text, "new") == f"before\n{BEGIN}\nnew\n{END}\nafter\n"
    assert insert(insert(text, "new"), "new") == insert(text, "new")


def test_kept_results_have_the_titles_of_the_networks() -> None:
    kept = json.loads(benchmark.RESULTS.read_text(encoding="utf-8"))["networks"]
    assert {name: one["title"] for name, one in kept.items()} == {
        name: case.title for name, case in NETWORKS.items()
    }
