"""Options that commands share, and the decorator that adds them to a command.

A group of options is a frozen dataclass whose fields are annotated for typer. `with_options` makes
an option of each field, so that a group is declared once, reaches its command as one value, and
names every value it holds. This module imports no Nengo: help does not wait for it.
"""

import functools
import inspect
import os
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import typer

from spikeport.commands.image_file import image_file
from spikeport.constants import DT_S, LARGEST_SEED, LONGEST_RUN
from spikeport.errors import UsageError

Result = TypeVar("Result")

ROUNDING_STEPS = 1e-6
"""The error that a decimal time divided by a step may have: 1e-7 in the longest run."""


def path_of(text: str) -> Path:
    """Return the path that an option names; an empty text would be the current folder."""
    if not str(text):
        raise typer.BadParameter("the path is empty, as of a shell variable that is not set")
    return Path(text)


def _no_cache(asked: bool) -> bool:
    """Switch the cache off if the user asks for it, in worker processes, too."""
    if asked:
        from spikeport.cache import switch_off

        switch_off()
    return asked


def written(help_text: str) -> Any:
    """Return the option for an output file or folder."""
    return typer.Option(help=help_text, parser=path_of, metavar="PATH")


ChipOption = Annotated[str, typer.Option(help="Name of a chip, or path of its TOML file.")]
PASSES_HELP = "as_written, compact, or a list like name,name{key=value}; see `spikeport passes`."
PassesOption = Annotated[
    str | None,
    typer.Option(
        "--passes",
        "-p",
        metavar="PASSES",
        help=PASSES_HELP,
    ),
]
OffloadOption = Annotated[
    bool,
    typer.Option("--offload", help="Move ensembles that break a rule of the chip to the host."),
]
ImageFile = Annotated[
    Path,
    typer.Argument(
        help="An image.npz that `compile --out` wrote, or its folder.", callback=image_file
    ),
]
SecondsOption = Annotated[
    float | None,
    typer.Option(help="Simulated time, in s; by default as docs/experiments.md says."),
]
SeedOption = Annotated[int, typer.Option(help="Seed of the run.", min=0, max=LARGEST_SEED)]
SettingsOption = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set a value of the network or experiment; repeatable.",
        default_factory=list,
        show_default=False,
    ),
]


NoCache = Annotated[
    bool,
    typer.Option(
        "--no-cache",
        callback=_no_cache,
        help="Use no results of earlier runs, and keep none; see `spikeport cache`.",
    ),
]
FaultsOption = Annotated[
    list[str],
    typer.Option(
        metavar="KIND@STEP",
        help="Inject a fault into the answers of the stub (or of this board, with board serve), "
        "such as cut@20, slow=5@20 (5 ms) or loss:0.1 (in a tenth of the steps); repeatable.",
        default_factory=list,
        show_default=False,
    ),
]


RunFolder = Annotated[Path | None, written("Folder of the run; by default one in runs/.")]
Overwrite = Annotated[bool, typer.Option(help="Replace an earlier run in this folder.")]
CountsOption = Annotated[
    bool,
    typer.Option(
        "--counts", help="Write the counts of spikes and operations of every step and core, too."
    ),
]


@dataclass(frozen=True, kw_only=True)
class Target:
    """The backend and chip that an experiment runs on, and the passes of its compile."""

    backend: Annotated[str, typer.Option(help="Name of a backend; see `spikeport backends`.")] = (
        "native"
    )
    chip: ChipOption = "loihi"
    passes: PassesOption = None


@dataclass(frozen=True, kw_only=True)
class Workers:
    """The workers of a sweep: processes of this machine, or workers of a Dask scheduler."""

    n: Annotated[
        int | None,
        typer.Option("--workers", help="Number of processes; by default one for each core.", min=1),
    ] = None
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tls://...",
            help="Address of a Dask scheduler; tcp://... is for trusted networks only.",
        ),
    ] = None

    @property
    def n_processes(self) -> int:
        """The number of processes: as many as asked for, or one for each core we may use."""
        return self.n or len(os.sched_getaffinity(0))


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
            help="In real time, hold the last outputs for at most so many steps of a late board.",
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
    "(20 ms in every step) or state-loss:0.1 (in a tenth of the steps); repeatable.",
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
class RunOptions:
    """The options of a run: seed, time, settings of the experiment, and outputs."""

    seed: SeedOption = 0
    seconds: SecondsOption = None
    settings: SettingsOption
    out: RunFolder = None
    overwrite: Overwrite = False
    video: Annotated[bool, typer.Option("--video", help="Write video.mp4, too.")] = False
    counts: CountsOption = False
    no_cache: NoCache = False


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
    baud: Annotated[int, typer.Option(help="Bit rate of the serial line, in bits/s.", min=1)] = (
        3_000_000
    )
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
        float | None, typer.Option(help="Physics steps and states per second: 200, 500 or 1000.")
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


def check_seconds(option: str, seconds: float) -> None:
    """Raise UsageError for an option that asks for a run of no steps, or of too many."""
    if not DT_S <= seconds <= LONGEST_RUN * DT_S:
        raise UsageError(
            f"{option} {seconds:g}: a run is at least one step of {DT_S:g} s, and at most "
            f"{LONGEST_RUN:,} steps"
        )
    check_whole_steps(option, seconds)


def check_whole_steps(option: str, seconds: float, dt_s: float = DT_S) -> None:
    """Raise UsageError for a time that a run of whole steps does not have."""
    steps = seconds / dt_s
    if abs(steps - round(steps)) > ROUNDING_STEPS:
        nearest_s = round(round(steps) * dt_s, 3)
        raise UsageError(
            f"{option} {seconds}: must be a whole number of steps of {dt_s:g} s; cure: {nearest_s}"
        )


def seeds_from(first: int, n: int, what: str) -> tuple[int, ...]:
    """Return ``n`` seeds in a row; UsageError if the last one is too large."""
    last = first + n - 1
    if last > LARGEST_SEED:
        raise UsageError(
            f"--seed {first}: the last of {n:,} {what} has seed {last}, limit {LARGEST_SEED}; "
            "cure: a smaller --seed"
        )
    return tuple(range(first, last + 1))


def given(*groups: Any) -> str:
    """Return the names of the options in groups whose values differ from their defaults."""
    return ", ".join(
        "--" + one.name.replace("_", "-")
        for group in groups
        for one in fields(group)
        if getattr(group, one.name) not in (one.default, [])  # a repeatable one has no default
    )


def with_options(command: Callable[..., Result]) -> Callable[..., Result]:
    """Return a command with an option for each field of the groups among its parameters."""
    hints = get_type_hints(command)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}

    @functools.wraps(command)
    def flattened(**values: Any) -> Result:
        made = {
            name: group(**{one.name: values.pop(one.name) for one in fields(group)})
            for name, group in groups.items()
        }
        return command(**values, **made)

    parameters = [
        one
        for name, parameter in inspect.signature(command).parameters.items()
        for one in (_options(groups[name]) if name in groups else [parameter])
    ]
    flattened.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters]
    )
    return flattened


def _options(group: Any) -> list[inspect.Parameter]:
    """Return a parameter for each field of a group, with its annotation and default."""
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            one.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if one.default is MISSING else one.default,
            annotation=hints[one.name],
        )
        for one in fields(group)
    ]
