"""The options and the outcome of a run, and the description of an experiment."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from spikeport.backends.board.link import OWN_STUB, LinkOptions
from spikeport.cache import NOTHING, Cache
from spikeport.compile.report.report import Report
from spikeport.constants import DT_S
from spikeport.digest import digest_of
from spikeport.errors import UsageError, unknown
from spikeport.experiments.run_folder import Result
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.activity import Activity
from spikeport.key_values import SettingValue, parse
from spikeport.progress import Progress, silent

if TYPE_CHECKING:
    from spikeport.experiments.trial import Settings, Trial
    from spikeport.robot.link.connection import RobotOptions

WITHOUT_NEURONS = "analytic"
"""The backend on which experiments run the exact control laws."""
REPLAY = "replay"
"""The backend that plays back the record of one run."""
BACKENDS = (
    WITHOUT_NEURONS,
    "reference",
    "native",
    "native-threads",
    "nengo-loihi",
    "board",
    REPLAY,
)
"""Names of backends, and of controllers without neurons, that experiments run on."""


ROUNDING_STEPS = 1e-6
"""The error that a decimal time divided by a step may have: 1e-7 in the longest run."""


def not_whole(seconds: float, dt_s: float = DT_S) -> str:
    """Return the rule and the cure for a time between two steps; "" for one of whole steps."""
    steps = seconds / dt_s
    if abs(steps - round(steps)) <= ROUNDING_STEPS:
        return ""
    nearest_s = round(round(steps) * dt_s, 3)
    return f"must be a whole number of steps of {dt_s:g} s; cure: {nearest_s}"


def keeps_to_a_clock(link: LinkOptions, robot: "RobotOptions | None") -> bool:
    """Return whether a run keeps to a clock, and so must not be delayed."""
    return link.real_time or (robot is not None and robot.real_time)


@dataclass(frozen=True)
class Options:
    """The options that all experiments share.

    Attributes
    ----------
    seconds : float
        Simulated time.
    backend, chip, pipeline : str
        The run's backend and chip, and the passes of its compile; by default the chip's passes.
    seed : int
        Seed of everything that varies between runs of the same controller.
    video : bool
        True if a video is made.
    link : LinkOptions
        The link to a board, for backends that have one.
    cache : Cache
        Keeps calibrations and rehearsals from run to run; by default nothing is kept.
    robot : RobotOptions or None
        The robot at the end of Unitree's interface; None for a plant in this process.
    counts : Path or None
        A folder for the counts of every step and core.
    progress : callable
        See `spikeport.progress.Progress`.
    command : tuple of str
        The command line, for ``result.json``.
    """

    seconds: float
    backend: str = "native"
    chip: str = "loihi"
    pipeline: str | None = None
    seed: int = 0
    video: bool = False
    link: LinkOptions = OWN_STUB
    cache: Cache = field(default=NOTHING, compare=False)
    robot: "RobotOptions | None" = None
    counts: Path | None = field(default=None, compare=False)
    progress: Progress = field(default=silent, compare=False)
    command: tuple[str, ...] = ()

    @property
    def has_neurons(self) -> bool:
        """True unless the controllers are the exact laws."""
        return self.backend != WITHOUT_NEURONS

    @property
    def calibrating_backend(self) -> str:
        """The backend for calibrations: native does what others with a chip do, and is faster."""
        return "reference" if self.backend == "reference" else "native"

    @property
    def substrate(self) -> dict[str, str]:
        """Chip and passes: if they are equal, neurons do the same on every backend with a chip."""
        if self.backend == "reference":
            # Float Nengo has neither, so its calibrations do not depend on the chip's name.
            return {"chip": "none", "passes": "none"}
        # A chip's file counts by its content, since it may move or change.
        own = digest_of(chips.get(self.chip))[:12] if chips.files_of(self.chip) else self.chip
        return {"chip": own, "passes": "by default" if self.pipeline is None else self.pipeline}


class Outcome(NamedTuple):
    """The outcome of a run: the content of ``result.json``, the compile's report, the counts."""

    result: Result
    report: Report | None
    activity: Activity


@dataclass(frozen=True)
class Experiment:
    """An experiment of the paper: its settings, and the trial that runs it.

    Attributes
    ----------
    trial : type of Trial
        The class of its runs, made from settings and options.
    settings : type
        The dataclass of its settings.
    backends : tuple of str
        The backends it runs on.
    seconds, shortest_s : float
        The default and the shortest simulated time.
    pipeline : str or None
        The default passes of its compile; None for the chip's passes.
    of_run : tuple of str
        Settings that change a run but not its network, like the seed of the run.
    lasts : callable or None
        Returns the simulated time of a run that ends with a schedule, from its settings and the
        requested time; None if a run always lasts for the requested time.
    """

    trial: "type[Trial[Any, Any]]"
    settings: type
    backends: tuple[str, ...]
    seconds: float
    shortest_s: float
    pipeline: str | None = None
    of_run: tuple[str, ...] = ()
    lasts: Callable[[Any, float], float] | None = None

    @property
    def name(self) -> str:
        """Its name, for commands."""
        return self.trial.name

    def passes(self, asked: str | None) -> str | None:
        """Return the passes of its compile: the requested ones ("" for none), or its own."""
        return self.pipeline if asked is None else asked

    def check_backend(self, name: str) -> None:
        """Raise UsageError for a backend that it does not run on."""
        if name not in self.backends:
            raise unknown(f"backend of {self.name}", name, self.backends)

    def check_backend_of_many(self, name: str, what: str) -> None:
        """Raise UsageError for a backend that ``what``, which is many runs, cannot use."""
        if name == REPLAY:
            raise UsageError(f"backend {REPLAY}: a record is of one run, not of {what}")
        if name not in self.backends:
            backends = [one for one in self.backends if one != REPLAY]
            raise unknown(f"backend of {self.name}", name, backends)

    def parse_settings(
        self, texts: Iterable[str], option: str = "--set"
    ) -> dict[str, SettingValue]:
        """Return settings from the ``KEY=VALUE`` texts of an option, as `key_values.parse` does."""
        return parse(texts, self.settings, f"experiment '{self.name}'", option)

    def run(self, settings: "Settings", options: Options, folder: Path) -> Outcome:
        """Run it and write its folder; see `spikeport.experiments.driver.run`."""
        from spikeport.experiments.driver import run  # needs the robot

        return run(self.trial(settings, options), folder)
