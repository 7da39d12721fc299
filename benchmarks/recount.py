"""A run's energy and step times, recomputed in NumPy from its counts and the chip's file.

    spikeport run reach --counts --out reach
    python benchmarks/recount.py reach [...]

prints both beside those of ``result.json``. It imports nothing of spikeport, and only reads runs on
one chip.
"""

import argparse
import hashlib
import itertools
import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import markdown_table
import numpy as np

LOIHI = Path(__file__).parents[1] / "hardware_models" / "chips" / "loihi.toml"
PER_STEP = {
    "synaptic_operation": "synaptic_operations",
    "update_active": "updates_active",
    "update_inactive": "updates_inactive",
    "spike": "spikes",
    "message_in": "messages_in",
    "learning_update": "learning_updates",
}
"""Names of the counts in a run's files, by the events of the chip's file."""
UNITS = {"pJ": 1e-12, "nJ": 1e-9, "uJ": 1e-6, "ns": 1e-9, "us": 1e-6}
"""Units of the chip's file, in J and s."""
HEADS = ("run", "calibration", "cost", "recomputed", "result.json")


class Recounted(NamedTuple):
    """Dynamic energy of a run in J, and the mean and the longest time of its steps in s."""

    energy_j: float
    mean_s: float
    longest_s: float


def recounted(counts: Path, calibration: Mapping[str, Any]) -> Recounted:
    """Return the costs of a run by a calibration of the chip's file.

    E = sum over events of count e,
    T_step = max over cores of (sum over events of count t) + barrier
    """
    parts = [np.load(file) for file in sorted(counts.glob("counts-*.npz"))]
    n = {event: np.concatenate([part[name] for part in parts]) for event, name in PER_STEP.items()}
    energies, times = (_in_si(calibration[kind]) for kind in ("energies", "times"))
    totals = {event: each.sum() for event, each in n.items()}
    totals |= _messages(np.load(counts / "messages.npz"))
    energy_j = sum(total * energies[event] for event, total in totals.items() if event in energies)
    idle_s = np.zeros(n["spike"].shape)
    busy_s = sum((n[event] * times[event] for event in n if event in times), idle_s)
    steps_s = busy_s.max(axis=1) + _barrier_s(calibration, n["spike"].shape[1])
    return Recounted(float(energy_j), float(steps_s.mean()), float(steps_s.max()))


def _in_si(figures: Mapping[str, Any]) -> dict[str, float]:
    return {event: figure["value"] * UNITS[figure["unit"]] for event, figure in figures.items()}


def _messages(messages: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Return the numbers of messages, and of their hops along the rows and columns of tiles."""
    between = messages["between_cores"]
    column, row = divmod(np.arange(len(between)) // 4, 4)  # four cores a tile, four tiles a column
    return {
        "message": between.sum() + messages["from_host"].sum(),
        "hop_east_west": (between * abs(column[:, None] - column)).sum(),
        "hop_north_south": (between * abs(row[:, None] - row)).sum(),
    }


def _barrier_s(calibration: Mapping[str, Any], cores: int) -> float:
    points = calibration["barrier"]
    at_s = [point["value"] * UNITS[point["unit"]] for point in points]
    return float(np.interp(-(-cores // 4), [point["tiles"] for point in points], at_s))


def compared(run: Path) -> Iterator[tuple[str, ...]]:
    """Yield rows of a run's costs by each calibration, recomputed and from ``result.json``."""
    result = json.loads((run / "result.json").read_text())
    for calibration in tomllib.loads(LOIHI.read_text())["calibrations"]:
        name = calibration["name"]
        own = recounted(run / "counts", calibration)
        timing = result["timing"][name]
        theirs = {
            "dynamic energy, J": (own.energy_j, result["energy"][name]["dynamic_run"]["value"]),
            "mean step, s": (own.mean_s, timing["mean"]["value"]),
            "longest step, s": (own.longest_s, timing["worst"]["value"]),
        }
        for cost, both in theirs.items():
            yield run.name, name, cost, *(f"{value:.10g}" for value in both)


def counted(text: str) -> Path:
    """Return the folder of a run that can be recounted; ArgumentTypeError for another one."""
    run = Path(text)
    file = run / "result.json"
    if not file.is_file():
        raise argparse.ArgumentTypeError(f"{run}: has no result.json; name the folder of a run")
    result = json.loads(file.read_text())
    words = result["command"]
    chips = [word.partition("=")[2] for word in words if word.startswith("--chip=")]
    chips += [chip for word, chip in itertools.pairwise(words) if word == "--chip"]
    others = [chip for chip in chips if not _is_loihi(chip, result.get("files", {}))]
    if others:
        raise argparse.ArgumentTypeError(
            f"{run}: is a run on {others[-1]}; only loihi is recounted"
        )
    if not (run / "counts" / "messages.npz").is_file():
        raise argparse.ArgumentTypeError(f"{run}: has no counts; run it again with --counts")
    return run


def _is_loihi(chip: str, files: Mapping[str, str]) -> bool:
    """Return whether a chip of a name or file is that of `LOIHI`; files are digests, by name."""
    own = hashlib.sha256(LOIHI.read_bytes()).hexdigest()
    found = files.get(str(Path(chip)))
    return chip == "loihi" if found is None else own.startswith(found)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+", type=counted, help="folders of runs with --counts")
    rows = [row for run in parser.parse_args(arguments).runs for row in compared(run)]
    print(markdown_table.table(HEADS, rows))


if __name__ == "__main__":
    main()
