"""The worst of many walks: every path, policies of five seeds and some sizes, on the chip.

    OPENBLAS_NUM_THREADS=1 python benchmarks/walk_matrix.py [--n-neurons N]... [--path PATH]...
        [--seed N]... [--backend BACKEND] [--set KEY=VALUE]... [--seconds S]

The worst and the mean are compared with those of the exact policy and exact follower on the same
path, with the same settings of path, policy and robot. Finished runs stay in ``build/walk_runs``,
in a folder for each policy, and are not repeated: delete them to measure again. Several processes
can share the seeds.
"""

import argparse
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from saved_runs import CALIBRATION, Clock, policy_key, saved_results

from spikeport.experiments.driver import Ready, on_chip, perform, prepare
from spikeport.experiments.options import BACKENDS, Options
from spikeport.experiments.policy.settings import OF_NEURONS as OF_POLICY
from spikeport.experiments.walk.metrics import metrics
from spikeport.experiments.walk.paths import SHAPES
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.trial import EXPERIMENT, WalkTrial
from spikeport.key_values import parse

RESULTS = Path("build/walk_runs")
OF_NEURONS = (*OF_POLICY, "calibrated", "follower", "silence", "silence_at")
"""Settings that a walk without neurons does not have."""
CHOSEN = {"n_neurons", "path", "network_seed"}
"""Settings that the options --n-neurons, --path and --seed choose."""
SIZES = (20, 10)
SEEDS = range(5)
WORST = (
    "falls",
    "cross_track_rms_m",
    "cross_track_max_m",
    "path_mse_m2",
    "speed_error_mean_m_s",
    "yaw_rate_error_mean_rad_s",
    "cores",
)
"""The figures whose largest value is printed."""


def trial(path: str, seed: int, backend: str, seconds: float, **settings: Any) -> WalkTrial:
    """Return a walk whose robot and neurons have the same seed."""
    chosen = WalkSettings(path=path, network_seed=seed, **settings)
    options = Options(seconds, backend, pipeline=EXPERIMENT.pipeline, seed=seed)
    return WalkTrial(chosen, options)


def result(trial: WalkTrial, ready: Ready[Any]) -> dict[str, Any]:
    """Return the metrics of a walk, its costs on the chip, and its speed in CPU time."""
    clock = Clock()
    trial = WalkTrial(trial.settings, dataclasses.replace(trial.options, progress=clock))
    done = perform(trial, ready)
    chip = on_chip(done.sim)
    found = {**dataclasses.asdict(trial.settings), **metrics(done)}
    found["cpu_real_time_factor"] = clock.factor(trial.options.seconds)
    if chip["resources"] is not None:
        energy = chip["energy"][CALIBRATION]["dynamic"]["energy_step"]["value"]
        found |= {"cores": chip["resources"]["cores"]["used"], "dynamic_energy_step_j": energy}
    return found


def walks(
    paths: list[str], seeds: list[int], backend: str, seconds: float, **settings: Any
) -> dict[str, list[dict[str, Any]]]:
    """Return the figures of all seeds, by path."""
    kind = "-".join(f"{key}{value}" for key, value in settings.items())
    policy = WalkSettings(**settings).walking_policy()
    folder = RESULTS / policy_key(policy)
    found: dict[str, list[dict[str, Any]]] = {path: [] for path in paths}
    for seed in seeds:
        trials = {path: trial(path, seed, backend, seconds, **settings) for path in paths}
        name = f"{backend}-{seconds:g}s-{kind}-{seed}"
        for run in saved_results(folder, name, trials, prepare, result):
            found[run["path"]].append(run)
    return found


def worst(runs: list[dict[str, Any]], exact: list[dict[str, Any]]) -> str:
    """Return the worst figures of some runs, in one line."""
    parts = [f"{key} {max(run.get(key, 0) for run in runs):.3g}" for key in WORST]
    rms_m, exact_m = ([run["cross_track_rms_m"] for run in some] for some in (runs, exact))
    times = max(rms_m) / max(exact_m), np.mean(rms_m) / np.mean(exact_m)
    factor = min(run["cpu_real_time_factor"] for run in runs)
    fell = sum(run["falls"] for run in runs)
    parts[0] = f"{fell} of {len(runs)} fell"
    return (
        f"{', '.join(parts)}; {times[0]:.2f}x the cross-track rms of the exact one, in mean "
        f"{times[1]:.2f}x; {factor:.1f}x real time in CPU time"
    )


def main() -> None:
    """Run the missing walks, and print the worst figures of each path and size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n-neurons", type=int, action="append")
    parser.add_argument("--path", action="append", choices=SHAPES)
    parser.add_argument("--seed", type=int, action="append")
    parser.add_argument("--backend", choices=BACKENDS, default="native")
    parser.add_argument("--set", action="append", dest="pairs", default=[])
    parser.add_argument("--seconds", type=float, default=EXPERIMENT.seconds)
    chosen = parser.parse_args()
    paths, seeds = chosen.path or list(SHAPES), chosen.seed or list(SEEDS)
    asked = parse(chosen.pairs, WalkSettings, "the walk")
    for key in CHOSEN & set(asked):
        parser.error(f"--set {key}=...: has an option of its own")
    shared = {key: value for key, value in asked.items() if key not in OF_NEURONS}
    exact = walks(paths, seeds, "analytic", chosen.seconds, **shared)
    for n_neurons in chosen.n_neurons or SIZES:
        found = walks(paths, seeds, chosen.backend, chosen.seconds, n_neurons=n_neurons, **asked)
        for path, runs in found.items():
            print(f"N={n_neurons} {path}: {worst(runs, exact[path])}", flush=True)


if __name__ == "__main__":
    main()
