"""The links that a command's options ask for."""

import os
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from spikeport.atomic import check_output
from spikeport.backends.board.address import Certificates
from spikeport.backends.board.link import LinkOptions, record_of
from spikeport.backends.board.opening import check
from spikeport.backends.board.record import Record
from spikeport.commands.option_groups import given
from spikeport.commands.options_of_links import Link, RobotLink, Tls
from spikeport.errors import UsageError

if TYPE_CHECKING:
    from spikeport.robot.link.connection import RobotOptions


def link_options(link: Link, tls: Tls, backend: str) -> LinkOptions:
    """Return the link of a run, after all checks that need no board: a compile may take long.

    Raises
    ------
    UsageError
        If an option is wrong or for another backend, if the file to record exists already or cannot
        be made, or if the file to replay is not named, or is not a record.
    """
    asked = LinkOptions(
        board=link.board,
        real_time=link.real_time,
        hold=link.hold,
        faults=tuple(link.fault),
        record=link.record,
        replay=link.replay,
        certificates=certificates(tls),
    )
    _check_backend(link, tls, backend)
    if backend == "board":
        check(asked)
    if asked.record is not None:
        _check_record(asked.record)
    if backend == "replay":
        Record(record_of(asked)).close()
    return asked


def _check_record(path: Path) -> None:
    """Refuse a file that exists, even as a dangling link, or that cannot be made."""
    check_output("--record", path)
    if os.path.lexists(path):
        raise UsageError(f"--record {path}: is there already; choose another file")


def _check_backend(link: Link, tls: Tls, backend: str) -> None:
    """Refuse options that would do nothing."""
    if backend != "replay" and link.replay is not None:
        raise UsageError(f"--replay is for --backend replay, not {backend}")
    idle = given(replace(link, replay=None), tls)
    if backend != "board" and idle:
        raise UsageError(f"{idle}: for --backend board, not {backend}; cure: leave it out")


def certificates(tls: Tls) -> Certificates | None:
    """Return the files of TLS; None if there are none, UsageError if some are missing."""
    if tls.cert is None and tls.key is None and tls.ca is None:
        return None
    if tls.cert is None or tls.key is None or tls.ca is None:
        raise UsageError("TLS takes three files: --cert, --key and --ca")
    return Certificates(tls.cert, tls.key, tls.ca)


def robot_options(link: RobotLink) -> "RobotOptions | None":
    """Return the robot of a run; None if it is a plant.

    Raises
    ------
    UsageError
        If options contradict each other, or name something unknown.
    MissingExtraError
        If the robot is at the end of DDS, and cyclonedds is absent.
    """
    if link.robot is None:
        _check_idle(link)
        return None
    from spikeport.robot.link.connection import INLINE, RobotOptions  # needs mujoco

    over_dds = link.robot.startswith("dds:")
    if link.robot_real_time and over_dds:
        raise UsageError("--robot-real-time is for --robot stub: a robot over DDS is in real time")
    if link.robot_lock_step and not over_dds:
        raise UsageError("--robot-lock-step is for --robot dds:...: others are in lock-step")
    asked = RobotOptions(
        robot=link.robot,
        real_time=link.robot_real_time or (over_dds and not link.robot_lock_step),
        faults=tuple(link.robot_fault),
        may_move_a_robot=link.may_move_a_real_robot,
        estimator=link.estimator,
        states=link.robot_states,
        priority=link.robot_priority,
    )
    asked.check()
    if asked.robot != INLINE:
        # Now, and not in a stub's process after a compile: a missing package ends a run here.
        import_module("spikeport.robot.link.bus")
    return asked


def _check_idle(link: RobotLink) -> None:
    """Refuse options of a link to a robot, in a run without one."""
    idle = given(link)
    if not idle:
        return
    from spikeport.robot.estimator.registry import WITHOUT_ODOMETRY  # needs mujoco

    cure = "leave it out"
    if link.estimator in WITHOUT_ODOMETRY:
        cure += f", or give --set estimator={link.estimator}, which walk and switch have"
    raise UsageError(f"{idle}: for a run with --robot; cure: {cure}")
