"""Options that choose a robot, and their combinations."""

import pytest

from spikeport.errors import UsageError
from spikeport.pacing import Pace
from spikeport.robot.link import connection
from spikeport.robot.link.client import InlineRobot
from spikeport.robot.link.connection import RobotOptions, connect
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.messages import ODOMETRY, TRUTHS
from spikeport.robot.link.place import Place
from spikeport.robot.link.settings import RobotSettings

HOIST = RobotSettings(hoist=True)


def test_a_place_is_an_interface_and_a_domain() -> None:
    assert RobotOptions("dds:lo:7").place == Place("lo", 7)


@pytest.mark.parametrize("text", ["", "dds", "dds:lo", "dds:lo:x", "dds::1", "stubb", "dds:a:b:1"])
def test_a_malformed_robot_option_is_refused_with_the_expected_form(text: str) -> None:
    with pytest.raises(UsageError, match="write inline, stub or dds:INTERFACE:DOMAIN"):
        connect(RobotOptions(text), HOIST)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (RobotOptions("stub", faults=("loss@3",), real_time=True), "is for lock-step"),
        (RobotOptions("inline", real_time=True), "an inline robot has no clock"),
        (RobotOptions("dds:lo:1", faults=("loss@3",)), "is for --robot inline and stub"),
        (RobotOptions("dds:lo:0"), "would move"),
        (RobotOptions("inline", faults=("cut@3",)), "--robot-fault 'cut@3'"),
        (RobotOptions("stub", states=True, real_time=True), "--robot-states is for"),
        (RobotOptions("dds:lo:1", states=True), "--robot-states is for"),
        (RobotOptions("stub", priority=10), "--robot-priority is for real time"),
        (RobotOptions("stub", estimator=""), "unknown estimator ''; choose from: ekf"),
        (RobotOptions("dds:lo:0", may_move_a_robot=True), "--robot-lock-step in domain 0"),
        (
            RobotOptions("dds:lo:0", real_time=True, may_move_a_robot=True, estimator="truth"),
            "only a simulation knows the truth",
        ),
    ],
)
def test_invalid_combinations_of_options_are_refused(options: RobotOptions, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        connect(options, HOIST)


def test_faults_of_a_stub_are_checked_before_it_starts() -> None:
    with pytest.raises(UsageError, match="--robot-fault 'cut@3'"):
        RobotOptions("stub", faults=("cut@3",)).check()


@pytest.mark.parametrize(
    ("text", "estimator"),
    [("inline", "truth"), ("stub", "truth"), ("dds:lo:1", "ekf")],
)
def test_a_robot_that_is_there_already_is_estimated_by_the_filter(
    text: str, estimator: str
) -> None:
    assert RobotOptions(text).estimates == estimator


def test_a_real_robot_is_started_by_hand_and_a_simulated_one_if_asked() -> None:
    assert RobotOptions("dds:lo:0", real_time=True).by_hand
    assert not RobotOptions("dds:lo:1", real_time=True).by_hand
    assert RobotOptions("dds:lo:1", real_time=True, states=True).by_hand


@pytest.mark.parametrize(
    ("options", "maker", "period_s"),
    [
        (RobotOptions("stub"), "StubRobot", None),
        (RobotOptions("stub", real_time=True), "StubRobot", 0.005),
        (RobotOptions("dds:lo:1"), "join", None),
        (RobotOptions("dds:lo:1", real_time=True), "join", 0.005),
        (RobotOptions("dds:lo:1", real_time=True, states=True), "join_by_hand", 0.005),
    ],
)
def test_a_robot_is_paced_in_real_time_and_joined_by_hand_where_its_user_starts_it(
    options: RobotOptions, maker: str, period_s: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[tuple[str, tuple[object, ...]]] = []
    for name in ("StubRobot", "join", "join_by_hand"):
        monkeypatch.setattr(connection, name, lambda *of, name=name: made.append((name, of)))
    connect(options, HOIST, paced=True)
    ((name, arguments),) = made
    paces = [(one.period_s, one.shared) for one in arguments if isinstance(one, Pace)]
    assert (name, paces) == (maker, [] if period_s is None else [(period_s, True)])


def test_a_stub_publishes_its_truth_unless_the_estimator_needs_odometry(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    needs: list[object] = []
    monkeypatch.setattr(connection, "StubRobot", lambda *of: needs.append(of[-1]))
    for estimator in (None, "ekf", "odometer"):
        connect(RobotOptions("stub", estimator=estimator), HOIST)
    assert needs == [TRUTHS, TRUTHS, ODOMETRY]


def test_an_inline_robot_gets_the_faults_of_its_options() -> None:
    robot = connect(RobotOptions("inline", faults=("nan@1",)), HOIST)
    assert isinstance(robot, InlineRobot)
    robot.exchange(robot.first(), DAMPING)
    assert robot.summary()["robot"]["refused"]["beyond_limits"] == 1
