"""The groups of commands for boards and robots."""

import pytest

from spikeport.errors import RobotLostError


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("board",), ["serve", "check", "inspect"]),
        (("board", "serve"), ["--listen", "--machine", "--fault", "--idle", "--allow-remote"]),
        (("robot",), ["serve"]),
        (("robot", "serve"), ["--interface", "--lock-step", "--pose", "--fault", "--watchdog-ms"]),
    ],
)
def test_help_lists_commands_and_options(spikeport, command, words):
    shown = spikeport(*command, "--help")
    assert shown.code == 0
    assert [word for word in words if word not in shown.out] == []


def test_wrong_options_of_servers_exit_with_2(spikeport):
    for command, message in (
        (("board", "serve", "--listen", "unix:x", "--idle", "0"), "Invalid value for '--idle'"),
        (("robot", "serve", "--may-move"), "No such option: --may-move"),
    ):
        done = spikeport(*command)
        assert done.code == 2
        assert message in done.err


def test_inspecting_a_path_that_is_not_a_record_exits_with_2(spikeport, tmp_path):
    (tmp_path / "empty").write_bytes(b"")
    for name in ("missing", "empty", "."):
        inspected = spikeport("board", "inspect", str(tmp_path / name))
        assert inspected.code == 2
        assert inspected.err.startswith(f"error: {tmp_path / name}: ")


def test_listening_to_a_real_robot_needs_no_permission_and_exits_with_1_if_it_is_refused(
    spikeport, monkeypatch
):
    from spikeport.robot.link import listener
    from spikeport.robot.link.place import Place

    asked = []

    def listen(place, seconds, say):
        asked.append((place, seconds))
        say("7 states")
        if seconds < 1:
            raise RobotLostError("7 states would be refused")

    monkeypatch.setattr(listener, "listen", listen)
    command = ("robot", "listen", "--domain", 0)
    assert spikeport(*command) == (0, "7 states\n", "")
    done = spikeport(*command, "--seconds", 0.5)
    assert done == (1, "7 states\n", "error: 7 states would be refused\n")
    assert asked == [(Place("lo", 0), 3.0), (Place("lo", 0), 0.5)]
