"""Neurons of M1 against cores, energy and error, as a table in Markdown.

    OPENBLAS_NUM_THREADS=1 python benchmarks/arm_sizes.py [--m1 N]... [--into docs/arm.md]

Finished runs stay in ``build/arm_runs``, see ``arm_matrix.py``.
"""

import argparse
from pathlib import Path
from typing import Any

import markdown_table
from arm_runs import draw_trial, reach_trial, results

from spikeport.networks.arm import PRESETS

SIZES = (200, 500, 1000, 2000, 8000)
PRESET_NAMES = {sizes.m1: name for name, sizes in PRESETS.items()}
"""Sizes that ``arm_matrix.py`` runs as well, under these names."""
DIGITS = (2, 5, 8)
TARGET_SEEDS = (0, 1)
HEADS = (
    "neurons per axis of M1",
    "neurons",
    "cores",
    "dynamic energy of a step (uJ)",
    "longest step (us)",
    f"shape error, digits {', '.join(map(str, DIGITS))} (mm rms)",
    "reaches in 15 s, small box",
)


def row(m1: int) -> list[str]:
    """Return cores, energy and task figures of one size."""
    name = PRESET_NAMES.get(m1, f"m1-{m1}")
    drawn = list(results({d: draw_trial(d, m1=m1) for d in DIGITS}, f"{name}-draw-0"))
    tried = {seed: reach_trial("small", seed, m1=m1) for seed in TARGET_SEEDS}
    reached = list(results(tried, f"{name}-small-0"))
    return [
        f"{m1:,}",
        f"{drawn[0]['neurons']:,}",
        str(max(run["cores"] for run in drawn + reached)),
        f"{1e6 * _most(drawn + reached, 'dynamic_energy_step_j'):.2f}",
        f"{1e6 * _most(drawn + reached, 'step_time_worst_s'):.0f}",
        ", ".join(f"{1000 * run['shape_error_rms_m']:.1f}" for run in drawn),
        ", ".join(str(run["reaches"]) for run in reached),
    ]


def _most(runs: list[dict[str, Any]], key: str) -> float:
    return max(float(run[key]) for run in runs)


def main() -> None:
    """Run the missing runs; print the table, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--m1", type=int, action="append")
    parser.add_argument("--into", type=Path)
    chosen = parser.parse_args()
    markdown_table.show(
        markdown_table.table(HEADS, (row(m1) for m1 in chosen.m1 or SIZES)), chosen.into
    )


if __name__ == "__main__":
    main()
