"""Runs of the reach experiment, its command line, and sweeps of the walk."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import xarray as xr

from spikeport.cache import Cache
from spikeport.cli import main
from spikeport.experiments import driver
from spikeport.experiments.arm.reach import ReachSettings, ReachTrial
from spikeport.experiments.options import Options, Outcome
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import Sweep
from spikeport.experiments.sweep.table import table
from spikeport.experiments.switch import rehearsal
from spikeport.experiments.walk import gait, trial
from spikeport.experiments.walk.gait import record_gait
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.robot.arm import ArmDynamics
from spikeport.robot.perturbation import NONE
from tests.helpers import stages
from tests.helpers.policies import save_pocket
from tests.helpers.sweeps import VARIED, finish


class Run(NamedTuple):
    """A finished run: its folder, its outcome, and the content of ``result.json``."""

    folder: Path
    outcome: Outcome
    result: dict[str, Any]


@pytest.fixture(scope="session")
def pocket(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the file of a policy that is converted and compiled in a second."""
    return str(save_pocket(tmp_path_factory.mktemp("pocket") / "policy.npz"))


def run_reach(folder: Path, seconds: float, **options: Any) -> Run:
    """Run the experiment; ``options`` are those of `Options` and `ReachSettings`."""
    names = ("box", "m1", "preset")
    settings = ReachSettings(**{key: options.pop(key) for key in names if key in options})
    outcome = driver.run(ReachTrial(settings, Options(seconds, **options)), folder)
    return Run(folder, outcome, json.loads((folder / "result.json").read_text()))


@pytest.fixture
def run(tmp_path: Path, kept: Cache) -> Callable[..., Run]:
    """Return a function that runs the experiment into an empty folder."""
    return lambda seconds, **options: run_reach(tmp_path, seconds, cache=kept, **options)


@pytest.fixture(scope="session")
def loihi(tmp_path_factory: pytest.TempPathFactory, kept: Cache) -> Run:
    """Return one second of a small controller on nengo-loihi's emulator."""
    folder = tmp_path_factory.mktemp("loihi")
    options = {"backend": "nengo-loihi", "cache": kept, "command": ("spikeport", "run")}
    return run_reach(folder, 1.0, m1=200, **options)


@pytest.fixture
def sweep_of() -> Callable[..., Sweep]:
    """Return a function that makes a sweep of the walk; its arguments replace the defaults."""

    def make(**replaced: Any) -> Sweep:
        asked = {
            "experiment": "walk",
            "backend": "native",
            "chip": "loihi",
            "pipeline": "compact",
            "seconds": 2.0,
            "settings": {"path": "paper"},
            "varied": {"n_neurons": (2, 20)},
            "seeds": (0,),
        }
        return Sweep(**{**asked, **replaced})

    return make


def shorten_gaits(monkeypatch: pytest.MonkeyPatch, gait_s: float, straight_s: float) -> None:
    """Shorten the gaits from which the ranges and calibrations of walks are made."""

    def short(policy, perturbations=(NONE,)):
        return record_gait(policy, perturbations, seconds=gait_s)

    for module in (gait, rehearsal, trial):
        monkeypatch.setattr(module, "record_gait", short)
    monkeypatch.setattr(gait, "STRAIGHT_S", straight_s)


@pytest.fixture
def short_gait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten gaits to the least that a calibration takes; a robot may fall on it."""
    shorten_gaits(monkeypatch, 1.0, 2.5)


@pytest.fixture
def fair_gait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten gaits so much that robots still walk for a while on their calibrations."""
    shorten_gaits(monkeypatch, 12.0, 8.0)


@pytest.fixture(scope="session")
def law() -> OperationalSpaceLaw:
    return OperationalSpaceLaw(ArmDynamics())


@pytest.fixture
def spikeport(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Return a function that runs a command in this process: exit code, output, errors."""

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["spikeport", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        out, err = capsys.readouterr()
        return int(end.value.code or 0), out, stages.taken_out(err)

    return command


@pytest.fixture
def finished(
    sweep_of: Callable[..., Sweep], tmp_path: Path
) -> tuple[Sweep, SweepFolder, xr.Dataset]:
    """Return a sweep in which one point of eight failed, its folder and its table."""
    sweep = sweep_of(varied=VARIED, seeds=(3, 4))
    folder = SweepFolder(tmp_path)
    for point in sweep.points()[:-1]:
        error = point.place["n_neurons"] + 0.1 * point.place["seed"]
        metrics = {"path_mse_m2": error, "cross_track_rms_m": 0.1, "falls": 0}
        finish(folder, point, **metrics, fallen_at_s=None, rates=[1.0])
    return sweep, folder, table(sweep, folder)
