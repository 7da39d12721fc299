"""The robot's process: it speaks DDS, and ends with its controller however that ends."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from unittest.mock import Mock

import pytest

from spikeport.pacing import Pace
from spikeport.robot.link.codec import (
    Command,
    decode_base,
    decode_state,
    encode_command,
)
from spikeport.robot.link.h1 import DAMPING
from tests.helpers.namespace import in_namespace

SERVE = [sys.executable, "-m", "spikeport", "robot", "serve", "--truth"]


def started(*options: str) -> subprocess.Popen[str]:
    """Return a robot's process, once it serves."""
    process = subprocess.Popen([*SERVE, *options], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline().startswith("robot: H1 on lo, domain 1")
    return process


def report(process: subprocess.Popen[str], within_s: float = 30) -> dict[str, object]:
    """Return a robot's report, once its process has ended."""
    words = process.communicate(timeout=within_s)[0].splitlines()[-1]
    return json.loads(words.removeprefix("robot: "))


def in_lock_step() -> dict[str, object]:
    """Answer ten states, with a second writer and damaged messages in between."""
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import COMMANDS, STATES, TRUTHS
    from spikeport.robot.link.place import Place

    process = started("--lock-step", "--hoist", "--once")
    ticks, truths = [], []
    with Bus(Place(), reliable=True) as bus:
        states, commands, reader = bus.reader(STATES), bus.writer(COMMANDS), bus.reader(TRUTHS)
        other = bus.writer(COMMANDS)
        until = time.monotonic() + 60
        # Neither all readers nor all writers are found at the same time.
        while not (truths and commands.n_readers and other.n_readers) and time.monotonic() < until:
            truths += [decode_base(arrival.message).tick for arrival in reader.take(0.2)]
        while len(ticks) < 10 and time.monotonic() < until:
            for arrival in states.take(0.2):
                tick, _ = decode_state(arrival.message)
                if ticks and tick == ticks[-1]:
                    continue
                good = encode_command(Command(tick, DAMPING))
                commands.write(good[:-1] + bytes([good[-1] ^ 1]))
                commands.write(good)
                if ticks:
                    other.write(good)
                ticks.append(tick)
            truths += [decode_base(arrival.message).tick for arrival in reader.take()]
        time.sleep(0.3)
    return {"ticks": ticks, "truths": sorted(set(truths))[:10], "robot": report(process)}


@pytest.mark.slow
def test_a_robot_in_lock_step_steps_once_for_each_answer() -> None:
    found = in_namespace(in_lock_step)
    assert found["ticks"] == list(range(5, 55, 5))
    assert found["truths"] == found["ticks"]
    robot = found["robot"]
    assert robot["steps"] == 10
    assert robot["refused"]["damaged"] == 10
    assert robot["refused"]["second_writer"] == 9


def one_after_the_other() -> dict[str, object]:
    """Let two controllers use one robot; return what each observed last, and the reports."""
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import TRUTHS
    from spikeport.robot.link.over_dds import LockStepRobot
    from spikeport.robot.link.place import Place

    process, found = started("--lock-step", "--fault", "nan@9"), []
    for _ in range(2):
        robot = LockStepRobot(Bus(Place(), reliable=True), TRUTHS)
        seen = robot.first()
        for _ in range(5):
            seen = robot.exchange(seen, DAMPING)
        found.append({"tick": seen.tick, "q": seen.sensors.q.tolist()})
        robot.close()  # and the next controller joins at once
    assert process.stdout is not None
    lines = [process.stdout.readline().removeprefix("robot: ").strip() for _ in 2 * found]
    process.terminate()
    process.communicate(timeout=30)
    reports = [json.loads(line) for line in lines[1::2]]
    return {"observed": found, "warnings": lines[::2], "reports": reports}


@pytest.mark.slow
def test_a_robot_in_lock_step_restarts_for_each_controller() -> None:
    found = in_namespace(one_after_the_other)
    one, other = found["observed"]
    assert one == other
    assert one["tick"] == 30
    first, second = found["reports"]
    unreached = "fault nan@9 was never reached: the robot's run has 5 steps"
    assert found["warnings"] == [unreached, unreached]
    assert first["steps"] == second["steps"] == 5
    assert first["motion"] == second["motion"]


def in_real_time() -> dict[str, object]:
    """Command a robot for a while, fall silent, and return its ticks and its report."""
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import COMMANDS, STATES
    from spikeport.robot.link.place import Place

    process = started("--hoist", "--once")
    with Bus(Place(), reliable=False) as bus:
        states, commands = bus.reader(STATES), bus.writer(COMMANDS)
        waiting = [_newest_tick(states) for _ in range(3)]
        for _ in range(20):
            commands.write(encode_command(Command(0, DAMPING)))
            time.sleep(0.01)
        for _ in range(30):
            last = _newest_tick(states)
    return {"waiting": waiting, "last": last, "robot": report(process)}


def in_sport_mode() -> dict[str, object]:
    """Command a robot in sport mode in vain, then join it, which releases the mode first."""
    from spikeport.robot.link import over_dds
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import COMMANDS
    from spikeport.robot.link.place import Place

    over_dds.LATEST_S = 10.0  # a busy machine must not end this run
    process = started("--hoist", "--sport-mode", "ai")
    with Bus(Place(), reliable=False) as bus:
        commands = bus.writer(COMMANDS)
        while not commands.n_readers:
            time.sleep(0.02)
        for _ in range(5):
            commands.write(encode_command(Command(0, DAMPING)))
            time.sleep(0.05)
    robot = over_dds.join(Place(), Pace(0.005))
    seen = robot.first()
    for _ in range(50):
        seen = robot.exchange(seen, DAMPING)
    robot.close()
    process.terminate()
    process.communicate(timeout=30)
    return {"modes": robot.summary()["released_modes"], "tick": seen.tick}


@pytest.mark.slow
def test_sport_mode_is_released_before_the_first_command() -> None:
    found = in_namespace(in_sport_mode)
    assert found["modes"] == ["ai"]
    assert found["tick"] > 2


def _newest_tick(states: object) -> int:
    until = time.monotonic() + 30
    while time.monotonic() < until:
        found = states.take(0.2)
        if found:
            time.sleep(0.02)
            return decode_state(found[-1].message)[0]
    return -1


@pytest.mark.slow
def test_time_stands_still_until_the_first_command_and_silence_damps_the_robot() -> None:
    found = in_namespace(in_real_time)
    assert found["waiting"] == [2, 2, 2]
    assert found["last"] > 100
    assert found["robot"]["watchdog_trips"] >= 1


def with_a_killed_controller() -> dict[str, object]:
    """Kill a controller before it leaves; the robot ends when the controller's lease does."""
    process = started("--lock-step", "--hoist", "--once")
    code = (
        "import time\n"
        "from spikeport.robot.link.bus import Bus\n"
        "from spikeport.robot.link.messages import COMMANDS\n"
        "from spikeport.robot.link.place import Place\n"
        "bus = Bus(Place(), reliable=True)\n"
        "writer = bus.writer(COMMANDS)\n"
        "while not writer.n_readers:\n    time.sleep(0.02)\n"
        "print('met', flush=True)\ntime.sleep(100)\n"
    )
    controller = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert controller.stdout is not None
    assert controller.stdout.readline() == "met\n"
    time.sleep(1.0)
    os.kill(controller.pid, signal.SIGKILL)
    controller.communicate()
    return {"robot": report(process), "code": process.returncode}


@pytest.mark.slow
def test_a_robot_ends_when_its_controller_was_killed() -> None:
    found = in_namespace(with_a_killed_controller)
    assert (found["code"], found["robot"]["steps"]) == (0, 0)


def alone() -> dict[str, object]:
    process = started("--once", "--idle", "0.5")
    return {"robot": report(process), "code": process.returncode}


@pytest.mark.slow
def test_a_robot_that_no_controller_joins_ends() -> None:
    assert in_namespace(alone)["code"] == 0


def ended() -> dict[str, object]:
    process = started()
    process.terminate()
    words = report(process)
    beside = [str(path) for path in Path("/dev/shm").iterdir() if "cyclone" in path.name]
    return {"code": process.returncode, "beside": beside, "steps": words["steps"]}


@pytest.mark.slow
def test_a_terminated_robot_prints_its_report_and_leaves_no_files() -> None:
    assert in_namespace(ended) == {"code": 0, "beside": [], "steps": 0}


def ended_at_its_first_line() -> dict[str, object]:
    """End a robot with the signal that arrives while its first line is printed."""
    from spikeport.robot.link.place import Place
    from spikeport.robot.link.server import Service, serve
    from spikeport.robot.link.settings import RobotSettings

    lines = []

    def say(line: str) -> None:
        lines.append(line)
        if len(lines) == 1:
            raise SystemExit(0)

    with pytest.raises(SystemExit):
        serve(Service(place=Place(), robot=RobotSettings()), say)
    return {"lines": [line.split()[1] for line in lines]}


@pytest.mark.slow
def test_a_robot_that_is_terminated_at_its_first_line_reports_too() -> None:
    assert in_namespace(ended_at_its_first_line) == {"lines": ["H1", '{"steps":']}


class LeavingWriters:
    """A reader of commands whose only writer is there at the first look, and gone at the next."""

    def __init__(self) -> None:
        self._looks = iter([[7], [], []])

    def take(self, within_s: float) -> list[object]:
        return []

    @property
    def writers(self) -> list[int]:
        return next(self._looks)


def test_a_process_that_writes_without_end_does_not_hide_that_the_controller_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from spikeport.robot.link import server

    monkeypatch.setattr(server, "SLICE_S", 0.0)
    flood = Mock(take=lambda _: [Mock()], writers=[])
    interface = Mock(commands=flood, note=Mock(side_effect=[False, True]))
    robot = Mock(silent=True, is_left=lambda _writers: True)
    server.serve_lock_step(robot, interface, Mock(), report := Mock())
    robot.restart.assert_called_once_with()
    report.assert_called_once_with()


def test_a_controller_that_leaves_between_two_looks_does_not_restart_the_robot() -> None:
    from spikeport.robot.link.server import Interface, serve_lock_step

    robot = Mock(silent=True)
    robot.is_left = lambda writers: 7 not in writers
    interface = Interface(Mock(reader=lambda topic: LeavingWriters()), Mock(once=True))
    serve_lock_step(robot, interface, Mock(), report := Mock())
    robot.restart.assert_not_called()
    report.assert_not_called()
