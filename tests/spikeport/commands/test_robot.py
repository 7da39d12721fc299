"""`robot serve` as a command, and the options of a run's robot."""

import sys
from typing import Any

import pytest

from spikeport.commands.links import robot_options
from spikeport.commands.options_of_links import RobotLink, RobotService
from spikeport.commands.robot import serve
from spikeport.errors import MissingExtraError, UsageError
from spikeport.fault_plan import Fault
from spikeport.robot.link.connection import RobotOptions
from spikeport.robot.link.odometer import OdometerErrors
from spikeport.robot.link.place import Place
from spikeport.robot.link.settings import RobotSettings


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"domain": 0}, "give --may-move-a-real-robot"),
        ({"interface": "nowhere"}, "no interface 'nowhere'"),
        (
            {"lock_step": False, "fault": ("loss@1",)},
            "--fault is for --lock-step: real time has faults of its own",
        ),
        ({"fault": ("lost@1",)}, "unknown kind of fault 'lost'"),
        ({"priority": 5}, "--priority is for real time; lock-step has no deadlines"),
        ({"lock_step": False, "rate_hz": 300.0}, "300 physics steps a second"),
        ({"rate_hz": 500.0}, "--rate-hz 500 with --lock-step: controllers step at 200 Hz"),
        ({"hoist": True, "let_down": float("inf")}, "--let-down inf: must be 0 or more"),
        ({"watchdog_ms": 0.0}, "a watchdog of 0 ms"),
        ({"odometer_error": ("drift_m=1",)}, "--odometer-error is for a robot with an --odometer"),
        ({"pose": ("tail=1",)}, "unknown joint 'tail'"),
        ({"pose": ("torso",)}, "--pose torso=: expected a number"),
        ({"pose": ("torso=inf",)}, "--pose torso=inf: input should be a finite number"),
        ({"pose": ("torso=0.1", "torso=0.5")}, "--pose torso: given twice"),
        ({"pose": ("torso=0.5",), "hoist": True}, "--pose torso: a robot on its hoist has its"),
    ],
)
def test_options_with_which_no_robot_can_be_served_are_refused(
    asked: dict[str, Any], words: str
) -> None:
    lists: dict[str, Any] = {"pose": [], "fault": [], "odometer_error": []}
    request = RobotService(**{**lists, "lock_step": True, "idle": 0.1, **asked})
    with pytest.raises(UsageError, match=words):
        serve(request)


@pytest.fixture
def served(spikeport, monkeypatch):
    """Return a function that gives the service that `robot serve` with some options makes."""
    server = pytest.importorskip("spikeport.robot.link.server", exc_type=ImportError)
    services: list[Any] = []
    monkeypatch.setattr(server, "serve", lambda service, _say: services.append(service))

    def serve(*options: object) -> Any:
        assert spikeport("robot", "serve", *options) == (0, "", "")
        return services.pop()

    return serve


def test_a_robot_in_real_time_has_all_settings_asked_for(served) -> None:
    from spikeport.robot.link.server import Service

    service = served(
        *("--domain", 7, "--rate-hz", 1000, "--priority", 5, "--truth", "--once", "--idle", 9),
        *("--hoist", "--let-down", 1.5, "--sport-mode", "ai", "--watchdog-ms", 40, "--seed", 3),
        *("--odometer", "--odometer-error", "drift_m=0.5", "--odometer-error", "turn_rad=0"),
        *("--pose", "left_knee=0.75", "--pose", "right_elbow=-0.25"),
    )
    assert service == Service(
        place=Place("lo", 7),
        robot=RobotSettings(
            rate_hz=1000,
            hoist=True,
            watchdog_s=0.04,
            seed=3,
            posture_rad={"left_knee": 0.75, "right_elbow": -0.25},
            sport_mode="ai",
            let_down_s=1.5,
            odometer=OdometerErrors(drift_m=0.5, turn_rad=0),
        ),
        truth=True,
        faults=[],
        once=True,
        idle_s=9,
        priority=5,
    )
    assert served("--odometer") == Service(
        place=Place(), robot=RobotSettings(rate_hz=500, odometer=OdometerErrors()), faults=[]
    )


def test_a_robot_in_lock_step_has_the_faults_asked_for_and_no_odometer_by_default(served) -> None:
    from spikeport.robot.link.server import Service

    assert served("--lock-step", "--fault", "restart@20", "--fault", "delay=5@7") == Service(
        place=Place(),
        robot=RobotSettings(),
        lock_step=True,
        faults=[Fault("restart", 20), Fault("delay", 7, delay_s=0.005)],
    )


def link(**options: Any) -> RobotLink:
    return RobotLink(**{"robot_fault": [], **options})


def test_a_run_without_a_robot_has_no_robot_options() -> None:
    assert robot_options(link()) is None


def test_a_robot_without_its_extra_is_refused_before_the_run(monkeypatch) -> None:
    monkeypatch.delitem(sys.modules, "spikeport.robot.link.bus", raising=False)
    monkeypatch.setitem(sys.modules, "cyclonedds._clayer", None)
    for robot in ("stub", "dds:lo:1"):
        with pytest.raises(MissingExtraError, match=r"a robot's interface needs the package"):
            robot_options(link(robot=robot))
    assert robot_options(link(robot="inline")) == RobotOptions("inline")


def test_stubs_are_in_lock_step_and_robots_over_dds_in_real_time_by_default() -> None:
    assert robot_options(link(robot="stub")) == RobotOptions("stub")
    assert robot_options(link(robot="stub", robot_real_time=True)) == RobotOptions("stub", True)
    assert robot_options(link(robot="dds:lo:1")) == RobotOptions("dds:lo:1", True)
    found = robot_options(link(robot="dds:lo:1", robot_lock_step=True))
    assert found == RobotOptions("dds:lo:1", False)
    assert robot_options(link(robot="stub")).estimates == "truth"
    assert robot_options(link(robot="dds:lo:1")).estimates == "ekf"
    assert robot_options(link(robot="stub", estimator="leg-odometry")).estimates == "leg-odometry"
    moved = robot_options(link(robot="dds:lo:0", may_move_a_real_robot=True))
    assert moved.by_hand
    assert not robot_options(link(robot="dds:lo:1")).by_hand
    assert robot_options(link(robot="dds:lo:1", robot_states=True)).by_hand
    assert moved == RobotOptions("dds:lo:0", True, may_move_a_robot=True)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (
            {"robot_fault": ["loss@1"], "may_move_a_real_robot": True},
            "^--robot-fault, --may-move-a-real-robot: for a run with --robot; cure: leave it out$",
        ),
        ({"estimator": "ekf"}, "^--estimator: for a run .* or give --set estimator=ekf, which"),
        ({"estimator": "odometer"}, "--estimator: for a run with --robot; cure: leave it out$"),
        ({"robot": "stub", "robot_states": True}, "is for --robot dds:... in real time"),
        (
            {"robot": "dds:lo:1", "robot_lock_step": True, "robot_states": True},
            "elsewhere a run starts at once",
        ),
        ({"robot": "inline", "estimator": "gps"}, "unknown estimator 'gps'"),
        ({"robot": "stub", "robot_lock_step": True}, "is for --robot dds"),
        ({"robot": "dds:lo:1", "robot_real_time": True}, "is for --robot stub"),
        ({"robot": "dds:lo:0"}, "would move"),
        (
            {"robot": "dds:lo:0", "may_move_a_real_robot": True, "estimator": "truth"},
            "only a simulation knows the truth",
        ),
        ({"robot": "stub", "robot_priority": 5}, "--robot-priority is for real time"),
        (
            {"robot": "dds:lo:0", "robot_lock_step": True, "may_move_a_real_robot": True},
            "does not wait for answers",
        ),
        ({"robot": "inline", "robot_fault": ["lost@1"]}, "unknown kind of fault 'lost'"),
    ],
)
def test_options_that_would_do_nothing_are_refused(asked: dict[str, Any], words: str) -> None:
    with pytest.raises(UsageError, match=words):
        robot_options(link(**asked))
