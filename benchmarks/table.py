"""The results of the benchmark as a table in Markdown: printed, or put between a file's markers.

python benchmarks/table.py [--into docs/figures.md]
"""

import argparse
import json
from pathlib import Path
from typing import Any

import markdown_table

RESULTS = Path(__file__).parent / "results.json"
HEADS = {
    "CPU time of a step, us": (
        "emulator, chip alone",
        "native",
        "ratio",
        "nengo-loihi, whole loop",
        "native",
        "ratio",
        "float Nengo",
        "ratio",
    ),
    "chip alone, native": (
        "spikes a step",
        "synaptic events a step",
        "events a second",
        "distinct weights read",
        "of the bandwidth of reading all weights",
    ),
}


def table(results: dict[str, Any]) -> str:
    """Return both tables, and a note on the machine that measured them."""
    networks = results["networks"].values()
    times, traffic = HEADS
    lines = [
        _table(times, [[n["title"], *_times(n)] for n in networks]),
        "",
        _table(traffic, [[n["title"], *_traffic(n)] for n in networks]),
        "",
        _note(results),
    ]
    return "\n".join(lines)


def _times(network: dict[str, Any]) -> list[str]:
    chip, whole = network["chip_us"], network["simulator_us"]
    pairs = (chip["nengo-loihi"], chip["native"]), (whole["nengo-loihi"], whole["native"])
    cells = [cell for a, b in pairs for cell in (f"{a:,.0f}", f"{b:,.0f}", f"{a / b:.0f}x")]
    return [*cells, f"{whole['nengo']:,.0f}", f"{whole['nengo'] / whole['native']:.1f}x"]


def _traffic(network: dict[str, Any]) -> list[str]:
    step_s = network["chip_us"]["native"] * 1e-6
    return [
        f"{network['spikes']:,.0f}",
        f"{network['synaptic_events']:,.0f}",
        f"{network['synaptic_events'] / step_s / 1e6:,.0f} million",
        *_read(network, step_s),
    ]


def _read(network: dict[str, Any], step_s: float) -> tuple[str, str]:
    """Return the bandwidth of distinct weights, and its share of the largest."""
    read, most = network["distinct_bytes"] / step_s, network["read_bytes_per_s"]
    share = f"{100 * read / most:.0f} % of {most / 1e9:.0f} GB/s"
    return f"{read / 1e9:.2f} GB/s", f"{share} ({network['stored_bytes'] / 1e6:.1f} MB)"


def _note(results: dict[str, Any]) -> str:
    machine, largest = results["machine"], max(results["networks"].values(), key=_weights)
    versions = ", ".join(f"{name} {machine[name]}" for name in list(machine)[1:])
    on = f"{machine['processor']}, one thread; {versions}."
    return (
        f"{on} An image of {_weights(largest):,} weights is extracted in "
        f"{largest['extract_s']:.1f} s and opened in {largest['open_s']:.1f} s."
    )


def _weights(network: dict[str, Any]) -> int:
    weights: int = network["weights"]
    return weights


def _table(corner: str, rows: list[list[str]]) -> str:
    return markdown_table.table([corner, *HEADS[corner]], rows)


def main() -> None:
    """Print the table, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--into", type=markdown_table.document)
    into = parser.parse_args().into
    markdown_table.show(table(json.loads(RESULTS.read_text(encoding="utf-8"))), into)


if __name__ == "__main__":
    main()
