"""The stub: a robot's process that is started, used and gone, whatever ends it."""

import os
import socket
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

import pytest

from spikeport.child import Child
from spikeport.errors import BackendError, RobotLostError
from spikeport.pacing import Pace
from spikeport.robot.link import stub
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.stub import StubRobot
from tests.helpers.namespace import in_namespace

HOIST = RobotSettings(hoist=True)


def a_stub() -> dict[str, object]:
    """Use a stub for a while, and return what is left of it."""
    robot = StubRobot(HOIST)
    seen = robot.first()
    for _ in range(3):
        seen = robot.exchange(seen, DAMPING)
    process = robot.process_id
    robot.close()
    children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text()
    return {
        "tick": seen.tick,
        "steps": robot.summary()["robot"]["steps"],
        "alive": Path(f"/proc/{process}").exists(),
        "children": children.split(),
        "sockets": Path("/proc/net/udp").read_text().splitlines()[1:],
    }


@pytest.mark.slow
def test_a_stub_ends_with_its_controller_and_leaves_nothing() -> None:
    assert in_namespace(a_stub) == {
        "tick": 20,
        "steps": 3,
        "alive": False,
        "children": [],
        "sockets": [],
    }


def a_stub_with_a_plan() -> list[str]:
    """Return the warnings of a stub with planned faults that is closed."""
    robot = StubRobot(HOIST, faults=("duplicate@3", "loss@4"))
    seen = robot.first()
    for _ in range(3):
        seen = robot.exchange(seen, DAMPING)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot.close()
    return [str(one.message) for one in caught]


@pytest.mark.slow
def test_a_stub_warns_of_a_fault_that_was_never_reached() -> None:
    line = "fault loss@4 was never reached: the robot's run has 3 steps"
    assert in_namespace(a_stub_with_a_plan) == [line]


def a_stub_that_cannot_leave() -> dict[str, object]:
    """Close a stub whose client fails, and return what is left of it."""
    robot = StubRobot(HOIST)
    leave, process, claim = robot._client.close, robot.process_id, robot._claim

    def fail() -> None:
        leave()
        raise BackendError("DDS cannot write (code -1)")

    robot._client.close = fail  # type: ignore[method-assign]
    try:
        robot.close()
    except BackendError as error:
        return {
            "error": str(error),
            "alive": Path(f"/proc/{process}").exists(),
            "claims": claim.fileno() != -1,
        }
    return {}


@pytest.mark.slow
def test_a_stub_ends_even_if_its_client_fails_to_close() -> None:
    assert in_namespace(a_stub_that_cannot_leave) == {
        "error": "DDS cannot write (code -1)",
        "alive": False,
        "claims": False,
    }


class KilledChild(Child):
    def __init__(self, name: str, arguments: Sequence[str]) -> None:
        super().__init__(name, arguments)
        os.kill(self.process_id, 9)


def a_stub_killed_before_its_first_state(real_time: bool) -> dict[str, object]:
    stub.Child = KilledChild  # type: ignore[misc]
    robot = StubRobot(HOIST, Pace(0.005) if real_time else None)
    begin = time.monotonic()
    try:
        robot.first()
    except RobotLostError as error:
        return {"error": str(error), "soon": time.monotonic() - begin < 5}
    finally:
        robot.close()
    return {}


@pytest.mark.slow
@pytest.mark.parametrize("real_time", [False, True])
def test_a_stub_killed_before_its_first_state_is_lost_at_once(real_time: bool) -> None:
    assert in_namespace(a_stub_killed_before_its_first_state, real_time) == {
        "error": "the robot sent no first state; its process ended: killed by SIGKILL",
        "soon": True,
    }


def a_killed_stub() -> dict[str, object]:
    robot = StubRobot(HOIST)
    seen = robot.first()
    os.kill(robot.process_id, 9)
    begin = time.monotonic()
    try:
        for _ in range(3):
            seen = robot.exchange(seen, DAMPING)
    except Exception as error:
        return {"error": f"{type(error).__name__}: {error}", "soon": time.monotonic() - begin < 60}
    finally:
        robot.close()
    return {}


@pytest.mark.slow
def test_a_killed_stub_is_reported_as_lost() -> None:
    found = in_namespace(a_killed_stub)
    assert found["error"].startswith("RobotLostError: the robot sent no state after that of 5 ms")
    assert "its process ended: killed by SIGKILL" in found["error"]
    assert found["soon"]


def test_two_stubs_have_domains_of_their_own() -> None:
    (one, first), (other, second) = stub._free_domain(), stub._free_domain()
    try:
        assert first != second
    finally:
        one.close()
        other.close()


def test_a_stub_without_a_free_domain_is_refused_and_leaves_no_claim(monkeypatch) -> None:
    sockets: list[socket.socket] = []

    class Claim(socket.socket):
        def __init__(self, *arguments: int) -> None:
            super().__init__(*arguments)
            sockets.append(self)

    monkeypatch.setattr(socket, "socket", Claim)
    first = 1000 + 2 * os.getpid()  # domains that no other process claims
    monkeypatch.setattr(stub, "DOMAINS", range(first, first + 2))
    claims = [stub._free_domain()[0] for _ in range(2)]
    try:
        with pytest.raises(BackendError, match=r"^2 stubs of robots run already; end some"):
            stub._free_domain()
        assert len(sockets) == 5  # the second stub tried the first domain, too
        assert [one for one in sockets if one.fileno() != -1] == claims
    finally:
        for claim in claims:
            claim.close()
