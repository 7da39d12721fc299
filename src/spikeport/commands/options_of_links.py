"""The options of links to boards and robots, at both of their ends: a run's, and a service's.

This module imports no Nengo: help does not wait for it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from spikeport.commands.options import SeedOption, written

FaultsOption = Annotated[
    list[str],
    typer.Option(
        metavar="KIND@STEP",
        help="Inject a fault into the answers of the stub (or of this board, with board serve), "
        "such as cut@20, slow=5@20 (5 ms) or loss:0.1 (in a tenth of the steps); kinds: "
        "docs/link.md; repeatable.",
        default_factory=list,
        show_default=False,
    ),
]


@dataclass(frozen=True, kw_only=True)
class Link:
    """The link to a board, for the backends ``board`` and ``replay``."""

    board: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS", help="Board of --backend board: stub, unix:PATH or tcp://HOST:PORT."
        ),
    ] = "stub"
    real_time: Annotated[
        bool,
        typer.Option("--real-time", help="Keep to the clock, and do not wait for a late board."),
    ] = False
    hold: Annotated[
        int,
        typer.Option(
            help="In real time, hold the last outputs for at most this many steps while the board "
            "is late.",
            min=0,
            max=1000,
        ),
    ] = 5
    fault: FaultsOption
    record: Annotated[Path | None, written("Record the board's session to this file.")] = None
    replay: Annotated[
        Path | None, typer.Option(help="Replay this record, with --backend replay.")
    ] = None


RobotFaultsOption = typer.Option(
    metavar="KIND@STEP",
    help="In lock-step, inject a fault into commands or states, such as restart@200, delay=20:1 "
    "(20 ms in every step) or state-loss:0.1 (in a tenth of the steps); kinds: docs/robot.md; "
    "repeatable.",
    default_factory=list,
    show_default=False,
)
MayMoveOption = Annotated[
    bool,
    typer.Option(
        "--may-move-a-real-robot",
        help="Allow domain 0 and interfaces other than lo, where a real robot may obey.",
    ),
]


@dataclass(frozen=True, kw_only=True)
class RobotLink:
    """The robot of a run, at the other end of Unitree's interface; by default a run has a plant."""

    robot: Annotated[
        str | None,
        typer.Option(
            metavar="ROBOT",
            help="Robot behind Unitree's interface: inline (in this process), stub (in its own) or "
            "dds:INTERFACE:DOMAIN (one that is running); by default a simulation without it.",
        ),
    ] = None
    robot_real_time: Annotated[
        bool, typer.Option("--robot-real-time", help="Run the stub in real time.")
    ] = False
    robot_lock_step: Annotated[
        bool,
        typer.Option(
            "--robot-lock-step", help="For a robot over DDS that is served with --lock-step."
        ),
    ] = False
    robot_states: Annotated[
        bool,
        typer.Option(
            "--robot-states",
            help="Start and stop a robot over DDS by keys; always on if a real robot may listen.",
        ),
    ] = False
    robot_priority: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Real-time priority of run and stub; not in lock-step.", min=1, max=99
        ),
    ] = None
    robot_fault: Annotated[list[str], RobotFaultsOption]
    estimator: Annotated[
        str | None,
        typer.Option(
            metavar="ESTIMATOR",
            help="Estimator of the robot's motion: truth (simulation only; for inline and stub by "
            "default), leg-odometry, ekf (for dds:... by default), odometer or ekf+odometer.",
        ),
    ] = None
    may_move_a_real_robot: MayMoveOption = False


@dataclass(frozen=True, kw_only=True)
class Tls:
    """The files of TLS, which a link to another machine needs."""

    cert: Annotated[Path | None, typer.Option(help="This side's certificate for TLS, PEM.")] = None
    key: Annotated[Path | None, typer.Option(help="The private key of that certificate, PEM.")] = (
        None
    )
    ca: Annotated[
        Path | None,
        typer.Option(help="Certificate of the authority that signed the other side's, PEM."),
    ] = None


@dataclass(frozen=True, kw_only=True)
class BoardService:
    """The options of a process that is a board."""

    listen: Annotated[
        str,
        typer.Option(metavar="ADDRESS", help="Address to listen on: unix:PATH or tcp://HOST:PORT."),
    ]
    machine: Annotated[
        str | None,
        typer.Option(
            "--machine",
            help="The board's program: native (the default), nengo-loihi, snips, nxsdk or rtl.",
        ),
    ] = None
    rtl: Annotated[
        bool, typer.Option("--rtl", help="Short for --machine rtl, the soft core in Verilator.")
    ] = False
    device: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Serial line of an FPGA with soft cores, which is then the board."
        ),
    ] = None
    baud: Annotated[
        int | None,
        typer.Option(help="Bit rate of --device, in bits/s; 3,000,000 by default.", min=1),
    ] = None
    keep: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keep the image of the last session in this file."),
    ] = None
    fault: FaultsOption
    once: Annotated[bool, typer.Option("--once", help="End after one session.")] = False
    idle: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="End after this time without a host.", min=0.1, max=10**6
        ),
    ] = None
    allow_remote: Annotated[
        bool, typer.Option("--allow-remote", help="Accept hosts on other machines, over TLS.")
    ] = False


InterfaceOption = Annotated[str, typer.Option(help="Network interface.")]
DomainOption = Annotated[int, typer.Option(help="DDS domain; that of a real robot is 0.")]


@dataclass(frozen=True, kw_only=True)
class RobotService:
    """The options of a process that is a robot."""

    interface: InterfaceOption = "lo"
    domain: DomainOption = 1
    may_move_a_real_robot: MayMoveOption = False
    lock_step: Annotated[
        bool,
        typer.Option(
            "--lock-step", help="Wait for the answer to each state; by default, run in real time."
        ),
    ] = False
    rate_hz: Annotated[
        float | None,
        typer.Option(
            help="Physics steps and states per second, from 200 to 1000, with a period of whole "
            "ms: 200, 250, 500 or 1000. By default 500; with --lock-step always 200."
        ),
    ] = None
    priority: Annotated[
        int | None,
        typer.Option(metavar="N", help="Real-time priority; not with --lock-step.", min=1, max=99),
    ] = None
    hoist: Annotated[
        bool,
        typer.Option(
            "--hoist",
            help="Hang the robot by its pelvis; in real time, press l to lower it, and l again to "
            "release it.",
        ),
    ] = False
    let_down: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="With --hoist, lower the robot this long after its first command, and release it "
            "4 s later, or once it stands if that is later.",
            min=0,
        ),
    ] = None
    sport_mode: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Begin in this sport mode, such as `ai`, and ignore commands until the mode is "
            "released.",
        ),
    ] = ""
    watchdog_ms: Annotated[
        float,
        typer.Option(
            help="Time without a valid command, in ms, after which all joints are damped."
        ),
    ] = 100.0
    truth: Annotated[
        bool, typer.Option("--truth", help="Publish the place and velocity of the pelvis, too.")
    ] = False
    odometer: Annotated[
        bool, typer.Option("--odometer", help="Publish odometry on rt/odommodestate.")
    ] = False
    odometer_error: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=VALUE",
            help="Error of the odometry: place_m, velocity_m_s, drift_m or turn_rad; repeatable.",
            default_factory=list,
            show_default=False,
        ),
    ]
    seed: SeedOption = 0
    pose: Annotated[
        list[str],
        typer.Option(
            metavar="JOINT=RAD",
            help="Initial angle of a joint; repeatable.",
            default_factory=list,
            show_default=False,
        ),
    ]
    fault: Annotated[list[str], RobotFaultsOption]
    once: Annotated[bool, typer.Option("--once", help="End when the first controller ends.")] = (
        False
    )
    idle: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="End after this time without a controller.", min=0.1, max=10**6
        ),
    ] = None
