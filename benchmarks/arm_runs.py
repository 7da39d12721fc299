"""Runs of the arm for the benchmarks: one network for many runs, one file for each that is done."""

import dataclasses
import json
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spikeport.experiments.arm_run import Rig, perform, prepare
from spikeport.experiments.arm_trial import ArmTrial
from spikeport.experiments.draw import DrawSettings, DrawTrial
from spikeport.experiments.on_chip import on_chip
from spikeport.experiments.options import Options
from spikeport.experiments.reach import ReachSettings, ReachTrial

RESULTS = Path("build/arm_runs")
CALIBRATION = "nahuku-fit"
"""Whose energies are given."""


@dataclass
class Clock:
    """Real-time factor of a simulation in this process's CPU time, taken from its progress."""

    share: list[float] = field(default_factory=list)
    cpu_s: list[float] = field(default_factory=list)

    def __call__(self, what: str, share: float | None) -> None:
        """See `spikeport.experiments.options.Progress`."""
        if what == "simulating" and share is not None:
            self.share.append(share)
            self.cpu_s.append(time.process_time())

    def factor(self, seconds: float) -> float:
        """Simulated time over CPU time."""
        return seconds * (self.share[-1] - self.share[0]) / (self.cpu_s[-1] - self.cpu_s[0])


def reach_trial(box: str, target_seed: int, **settings: Any) -> ArmTrial:
    """A reach run of 15 s."""
    options = Options(RESULTS, 15.0, seed=target_seed, progress=Clock())
    return ReachTrial(ReachSettings(box=box, **settings), options)


def draw_trial(digit: int, **settings: Any) -> ArmTrial:
    """A drawing of 12 s."""
    return DrawTrial(
        DrawSettings(digit=digit, **settings), Options(RESULTS, 12.0, progress=Clock())
    )


def results(trials: Mapping[int, ArmTrial], name: str) -> Iterator[dict[str, Any]]:
    """The figures of numbered trials that need the same network; what was done before is read."""
    rig: Rig | None = None
    for number, trial in trials.items():
        file = RESULTS / f"{name}-{number}.json"
        if not file.exists():
            rig = rig or prepare(trial)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(_result(trial, rig), indent=2), encoding="utf-8")
        yield json.loads(file.read_text(encoding="utf-8"))
    if rig is not None:
        rig.sim.close()


def _result(trial: ArmTrial, rig: Rig) -> dict[str, Any]:
    """The metrics of a run, what it took on the chip, and how fast the processor was."""
    done = perform(trial, rig)
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
