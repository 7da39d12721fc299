"""Runs of the arm for the benchmarks: one network for many runs, one file for each finished run."""

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from saved_runs import CALIBRATION, Clock, saved_results

from spikeport.experiments.arm.draw import DrawSettings, DrawTrial
from spikeport.experiments.arm.reach import ReachSettings, ReachTrial
from spikeport.experiments.arm.trial import ArmTrial
from spikeport.experiments.driver import Ready, on_chip, perform, prepare
from spikeport.experiments.options import Options

RESULTS = Path("build/arm_runs")


def reach_trial(box: str, target_seed: int, **settings: Any) -> ArmTrial:
    """Return a reach run of 15 s."""
    options = Options(15.0, seed=target_seed, progress=Clock())
    return ReachTrial(ReachSettings(box=box, **settings), options)


def draw_trial(digit: int, **settings: Any) -> ArmTrial:
    """Return a drawing of 12 s."""
    return DrawTrial(DrawSettings(digit=digit, **settings), Options(12.0, progress=Clock()))


def results(trials: Mapping[int, ArmTrial], name: str) -> Iterator[dict[str, Any]]:
    """Return the figures of trials with the same network; finished ones are read from files."""
    return saved_results(RESULTS, name, trials, prepare, _result)


def _result(trial: ArmTrial, ready: Ready[Any]) -> dict[str, Any]:
    """Return the metrics of a run, its costs on the chip, and its speed in CPU time."""
    done = perform(trial, ready)
    assert isinstance(trial.options.progress, Clock)
    chip = on_chip(done.sim)
    return {
        **dataclasses.asdict(trial.settings),
        **trial.metrics(done),
        "neurons": trial.settings.sizes.total,
        "cores": chip["resources"]["cores"]["used"],
        "dynamic_energy_step_j": chip["energy"][CALIBRATION]["dynamic"]["energy_step"]["value"],
        "step_time_worst_s": chip["timing"][CALIBRATION]["worst"]["value"],
        "cpu_real_time_factor": trial.options.progress.factor(trial.options.seconds),
    }
