"""The settings of the switching experiment."""

import math
from dataclasses import dataclass
from pathlib import Path

from spikeport.errors import unknown
from spikeport.experiments.arm.strokes import DIGITS
from spikeport.experiments.policy.settings import PolicySettings
from spikeport.experiments.switch.schedule import SHIPPED, Schedule, load
from spikeport.experiments.walk.path_file import path_files
from spikeport.networks.arm import PRESETS
from spikeport.networks.option_checks import check_name_or_file

SELECTIONS = ("own", "spa")


@dataclass(frozen=True, kw_only=True)
class SwitchSettings(PolicySettings):
    """Settings of the schedule and the controller; see `PolicySettings` for the other settings.

    ``schedule`` is a shipped schedule, ``switch`` or ``free-standing``, or a TOML file like
    ``switch.toml``; ``digit`` is the digit of its drawing phases. While the arm works, the pelvis
    is welded to the world if ``anchor`` is true, as in the paper; else the policy goes on, and
    keeps the robot standing. ``preset`` is the size of the arm's controller, ``lean`` or ``paper``.
    ``selection`` is ``own`` for basal ganglia that the chip can hold, or ``spa`` for the unchanged
    basal ganglia of nengo_spa, in float only.
    """

    schedule: str = "switch"
    digit: int = 8
    anchor: bool = True
    preset: str = "lean"
    selection: str = "own"

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        super().__post_init__()
        check_name_or_file("schedule", self.schedule, SHIPPED)
        if self.preset not in PRESETS:
            raise unknown("preset", self.preset, PRESETS)
        if self.selection not in SELECTIONS:
            raise unknown("selection", self.selection, SELECTIONS)
        if self.digit not in DIGITS:
            raise unknown("digit", str(self.digit), map(str, DIGITS))

    @property
    def files(self) -> list[Path]:
        """The files that a run reads, including those of the schedule's paths."""
        found = super().files
        if self.schedule not in SHIPPED:
            phases = load(self.schedule_file, math.inf).phases
            paths = sorted({phase.path for phase in phases if phase.path is not None})
            found += [self.schedule_file, *(file for path in paths for file in path_files(path))]
        return found

    @property
    def schedule_file(self) -> Path:
        """The file of the schedule."""
        return SHIPPED.get(self.schedule, Path(self.schedule))

    def lasts(self, seconds: float) -> float:
        """Return the time at which the schedule ends, in a run of at most ``seconds``."""
        return self.load_schedule(seconds).end_s

    def load_schedule(self, seconds: float) -> Schedule:
        """Load the schedule, for a run of at most ``seconds``; see `schedule.load`."""
        return load(self.schedule_file, seconds)
