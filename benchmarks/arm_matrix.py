"""The worst of many runs of the arm: three network seeds, five target seeds and all ten digits.

    OPENBLAS_NUM_THREADS=1 python benchmarks/arm_matrix.py [--preset lean] [--calibrated]
        [--network-seed N]... [--digit N]... [--task TASK]...

Finished runs stay in ``build/arm_runs`` and are not repeated: delete them to measure again.
"""

import argparse
from collections.abc import Sequence
from typing import Any

from arm_runs import draw_trial, reach_trial, results

from spikeport.experiments.arm.strokes import DIGITS
from spikeport.experiments.arm.trial import ArmTrial
from spikeport.networks.arm import PRESETS

TASKS = ("small", "large", "draw")
NETWORK_SEEDS = (0, 1, 2)
TARGET_SEEDS = range(5)


def trials(task: str, digits: Sequence[int], **settings: Any) -> dict[int, ArmTrial]:
    """Return the runs of one network, by digit or seed of the targets."""
    if task == "draw":
        return {digit: draw_trial(digit, **settings) for digit in digits}
    return {seed: reach_trial(task, seed, **settings) for seed in TARGET_SEEDS}


def worst(task: str, runs: list[dict[str, Any]]) -> str:
    """Return the worst figure of each kind over some runs, in one line."""
    factors = [run["cpu_real_time_factor"] for run in runs]
    shared = (
        f"read-out spikes {max(run['readout_spikes'] for run in runs)}, at joint limits "
        f"{max(run['joint_limit_steps'] for run in runs)} steps, "
        f"{max(run['cores'] for run in runs)} cores, "
        f"{min(factors):.1f} to {max(factors):.1f}x real time in CPU time"
    )
    if task != "draw":
        least = min(run["reaches"] for run in runs)
        longest = max(run["seconds_per_reach_max"] for run in runs)
        return f"{least} to {max(r['reaches'] for r in runs)} reaches, {longest:.2f} s, {shared}"
    errors = [1000 * run["shape_error_rms_m"] for run in runs]
    read = [run for run in runs if run["recognised_as"] is not None]  # None without a classifier
    misread = sum(run["recognised_as"] != run["digit"] for run in read)
    found = f"{misread} of {len(read)} misread" if read else "not read"
    return f"{min(errors):.1f} to {max(errors):.1f} mm, {found}, {shared}"


def main() -> None:
    """Run the missing runs, and print the worst figures of each task."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", choices=PRESETS, default="lean")
    parser.add_argument("--calibrated", action="store_true")
    parser.add_argument("--task", action="append", choices=TASKS)
    parser.add_argument("--network-seed", type=int, action="append")
    parser.add_argument("--digit", type=int, action="append", choices=DIGITS)
    chosen = parser.parse_args()
    kind = chosen.preset + ("-calibrated" if chosen.calibrated else "")
    for task in chosen.task or TASKS:
        runs = []
        for seed in chosen.network_seed or NETWORK_SEEDS:
            settings = {"preset": chosen.preset, "calibrated": chosen.calibrated}
            found = trials(task, chosen.digit or DIGITS, network_seed=seed, **settings)
            some = list(results(found, f"{kind}-{task}-{seed}"))
            print(f"{kind} {task}, network {seed}: {worst(task, some)}", flush=True)
            runs += some
        print(f"{kind} {task}, {len(runs)} runs: {worst(task, runs)}", flush=True)


if __name__ == "__main__":
    main()
