"""Experiments on a robot behind a link: in one process, in two, and with a board in three.

The runs must agree in the robot's motion (float64), the time series and the counts of every core.
"""

import functools
import hashlib
import itertools
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spikeport.backends.board.link import LinkOptions
from spikeport.cache import NOTHING, Cache
from spikeport.errors import BoardLostError, DivergedError, RobotLostError, UsageError
from spikeport.experiments import driver, registry
from spikeport.experiments.driver import Ready
from spikeport.experiments.options import Options
from spikeport.experiments.walk import legs
from spikeport.experiments.walk.recording import WalkRun
from spikeport.experiments.walk.trial import WalkTrial
from spikeport.robot.link.client import InlineRobot, Observed
from spikeport.robot.link.connection import RobotOptions
from spikeport.robot.signals import MotorCommands
from tests.helpers.namespace import in_namespace


def run(
    name: str,
    backend: str,
    robot: str,
    seconds: float,
    folder: str = "",
    faults: tuple[str, ...] = (),
    estimator: str | None = None,
    real_time: bool = False,
    kept: str = "",
) -> dict[str, object]:
    """Return a run's motion, the digest of its time series, its counts and its link's figures.

    ``folder`` and ``kept`` are those of the run and of its cache, if any.
    """
    experiment = registry.get(name)
    with tempfile.TemporaryDirectory() as made, pytest.MonkeyPatch.context() as patch:
        patch.setattr(driver, "draw_scenes", lambda *_: ())  # they take longer than a short run
        out = Path(folder or made)
        options = Options(
            seconds=seconds,
            backend=backend,
            cache=Cache(Path(kept)) if kept else NOTHING,
            link=LinkOptions(),
            robot=RobotOptions(robot, real_time, tuple(faults), estimator=estimator),
        )
        result = experiment.run(experiment.settings(), options, out).result
        probes = hashlib.sha256(_values(out / "probes.nc")).hexdigest()
    link = result["robot"]
    return {
        "motion": link["robot"]["motion"],
        "steps": link["robot"]["steps"],
        "states": link["states"],
        "damaged": link["damaged"],
        "estimator": link["estimator"],
        "set": result["settings"].get("estimator"),
        "probes": probes,
        "activity": result["activity"],
    }


def _values(path: Path) -> bytes:
    import xarray as xr

    with xr.open_dataset(path) as series:
        return b"".join(np.asarray(series[name]).tobytes() for name in sorted(series.variables))


WALKS: dict[str, tuple[tuple[str, ...], str | None]] = {
    "plain": ((), None),
    "faulty": (
        ("loss:0.2", "jitter=5:1", "state-delay=10:1", "state-loss:0.1", "state-reorder:0.1"),
        "odometer",
    ),
    "estimate": ((), "ekf"),
}
"""For each walk the faults of its link, and its estimator."""


def walk(name: str, robot: str) -> dict[str, Any]:
    """Return one of `WALKS`, for half a second."""
    faults, estimator = WALKS[name]
    return run("walk", "analytic", robot, 0.5, faults=faults, estimator=estimator)


def states_in_real_time() -> int | None:
    """Return the number of states of a walk in real time; None if this machine was too slow."""
    try:
        walked = run("walk", "analytic", "stub", 1.0, real_time=True)
    except RobotLostError as lost:
        if "no new state for" not in str(lost):
            raise
        return None
    states: Any = walked["states"]
    return int(states)


def walks_in_two() -> dict[str, Any]:
    """Return all walks with the robot in a process of its own, and the states in real time."""
    return {**{name: walk(name, "stub") for name in WALKS}, "real time": states_in_real_time()}


@pytest.fixture(scope="module")
def in_two() -> dict[str, Any]:
    """Return all walks from one namespace: to enter one and import takes longer than a walk."""
    found: dict[str, Any] = in_namespace(walks_in_two)
    return found


@pytest.fixture(scope="module")
def inline() -> Callable[[str], dict[str, Any]]:
    """Return a function that walks one of `WALKS` once, with the robot in this process."""
    return functools.cache(lambda name: walk(name, "inline"))


@pytest.mark.slow
@pytest.mark.parametrize("name", WALKS)
def test_a_walk_is_the_same_in_one_process_and_in_two(
    name: str, inline: Callable[[str], dict[str, Any]], in_two: dict[str, Any]
) -> None:
    walked = inline(name)
    assert in_two[name] == walked
    assert walked["steps"] == 100
    assert (walked["motion"] == inline("plain")["motion"]) == (name == "plain")


@pytest.mark.slow
def test_a_walk_in_real_time_goes_on_after_its_first_step(in_two: dict[str, Any]) -> None:
    """Its length depends on the machine: a robot whose commands are too late damps itself."""
    states = in_two["real time"] or in_namespace(states_in_real_time)
    assert states is not None, "two runs lost the robot: it is silent, or the machine too busy"
    assert states > 1


@pytest.mark.slow
def test_only_faults_lose_states(inline: Callable[[str], dict[str, Any]]) -> None:
    assert inline("plain")["states"] == 100
    assert inline("faulty")["states"] < 100


@pytest.mark.slow
def test_faulty_commands_change_a_walk(inline: Callable[[str], dict[str, Any]]) -> None:
    faulty = run("walk", "analytic", "inline", 0.5, faults=("loss:0.2", "jitter=5:1"))
    assert faulty["motion"] != inline("plain")["motion"]


@pytest.mark.slow
def test_an_estimate_is_near_the_robots_velocity(
    inline: Callable[[str], dict[str, Any]],
) -> None:
    odometer, ekf = inline("faulty"), inline("estimate")
    assert 0.01 < max(odometer["estimator"]["velocity_error_m_s"]) < 0.05
    assert max(ekf["estimator"]["velocity_error_m_s"]) < 0.05
    assert ekf["estimator"]["name"] == ekf["set"] == "ekf"


@pytest.mark.slow
def test_a_reach_on_the_chip_is_the_same_with_board_and_robot_in_processes_of_their_own(
    kept: Cache,
) -> None:
    options: Any = ("", [], None, False, str(kept.folder))
    inline = run("reach", "native", "inline", 0.3, *options)
    assert inline["activity"]["spikes"] > 0
    assert in_namespace(run, "reach", "board", "stub", 0.3, *options) == inline


@pytest.mark.parametrize(
    ("fault", "words"), [("stop@30", "sent no state after"), ("restart@30", "began anew")]
)
def test_the_last_states_of_a_lost_robot_are_written(
    fault: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(RobotLostError, match=f"{words}.*its last states are in"):
        run("walk", "analytic", "inline", 1.0, str(tmp_path), (fault,))
    with np.load(tmp_path / "last_states.npz") as states:
        assert states["time_s"][-1] == pytest.approx(0.145)


def test_a_robot_that_never_sent_a_state_leaves_no_file(monkeypatch, tmp_path: Path) -> None:
    def first(_robot: InlineRobot) -> None:
        raise RobotLostError("no robot to begin with")

    monkeypatch.setattr(InlineRobot, "first", first)
    with pytest.raises(RobotLostError, match=r"^no robot to begin with$"):
        run("walk", "analytic", "inline", 1.0, str(tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_a_robot_that_lies_on_the_floor_at_the_start_ends_the_run_with_a_cure(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(legs, "fallen", lambda height_m, upright: True)
    with pytest.raises(RobotLostError, match="lies on the floor as the run begins; cure: stand it"):
        run("walk", "analytic", "inline", 1.0, str(tmp_path))


def test_the_error_of_a_lost_board_is_kept_if_the_robot_is_lost_in_damping(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The controller of a robot that is started by hand gives up if no state comes for long."""

    def fail(_trial: object, ready: Ready, _watched: object) -> None:
        ready.closed.rig.plant.step()
        monkeypatch.setattr(InlineRobot, "exchange", leave)
        raise BoardLostError("the board does not answer")

    def leave(_robot: InlineRobot, _last: object, _motors: object) -> None:
        raise RobotLostError("no new state for 10000 ms")

    monkeypatch.setattr(driver, "_simulate", fail)
    with pytest.raises(BoardLostError, match=r"the board does not answer; .* last states are in"):
        run("walk", "analytic", "inline", 1.0, str(tmp_path))
    assert (tmp_path / "last_states.npz").exists()


@pytest.mark.parametrize("error", [DivergedError, RobotLostError])
def test_a_robot_is_closed_before_its_last_states_are_written(
    error: type[Exception], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Closing damps the robot, and must not wait until the folder is cleared and written."""
    order: list[str] = []
    leave = InlineRobot.close

    def fail(_trial: object, ready: Ready, _watched: object) -> None:
        ready.closed.rig.plant.step()
        raise error("lost")

    def close(robot: InlineRobot) -> None:
        order.append("left")
        leave(robot)

    def write(folder: Path, history: dict[str, np.ndarray]) -> Path:
        order.append(f"{len(history['time_s'])} states")
        return folder

    monkeypatch.setattr(driver, "_simulate", fail)
    monkeypatch.setattr(InlineRobot, "close", close)
    monkeypatch.setattr(driver.run_folder, "write_last_states", write)
    with pytest.raises((DivergedError, RobotLostError), match=r"lost; .* in "):
        run("walk", "analytic", "inline", 1.0, str(tmp_path))
    assert order == ["left", "2 states"]


@pytest.mark.slow
def test_a_robot_is_left_in_damping_before_its_run_is_recorded(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A recording of 20 s takes 0.1 s, in which nobody would command the robot."""
    order: list[str] = []
    leave, record = InlineRobot.close, WalkTrial.record

    def close(robot: InlineRobot) -> None:
        order.append("left")
        leave(robot)

    def recorded(*arguments: Any) -> WalkRun:
        order.append("recorded")
        return record(*arguments)

    monkeypatch.setattr(InlineRobot, "close", close)
    monkeypatch.setattr(WalkTrial, "record", recorded)
    assert run("walk", "analytic", "inline", 0.1, str(tmp_path))["steps"] == 20
    assert order == ["left", "recorded"]


@pytest.mark.slow
def test_a_run_goes_on_if_no_new_state_comes_in_its_first_step(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """In real time, where a robot's clock is its own, most first steps do not take 5 ms."""
    exchange, steps = InlineRobot.exchange, itertools.count()

    def held_first(robot: InlineRobot, last: Observed, motors: MotorCommands) -> Observed:
        return exchange(robot, last, motors) if next(steps) else last

    monkeypatch.setattr(InlineRobot, "exchange", held_first)
    assert run("walk", "analytic", "inline", 0.1, str(tmp_path))["steps"] == 19


def test_an_anchor_is_refused_for_a_robot_behind_a_link() -> None:
    with pytest.raises(UsageError, match="anchor=true: holds the walking robot by its pelvis"):
        run("switch", "analytic", "inline", 26.0)
