"""The settings of the switching experiment."""

from dataclasses import dataclass
from pathlib import Path

from spikeport.errors import UsageError, unknown
from spikeport.experiments.arm.settings import LARGEST_SEED
from spikeport.experiments.arm.strokes import DIGITS
from spikeport.experiments.switch.schedule import SHIPPED, Schedule, load
from spikeport.networks.arm import PRESETS
from spikeport.networks.policy import PolicyOptions


@dataclass(frozen=True, kw_only=True)
class SwitchSettings:
    """Settings of the schedule, the controller, and how the robot looks.

    ``schedule`` is a TOML file like ``switch.toml``, which is used where none is given; ``digit``
    is what its drawing phases draw. While the arm is at work, the pelvis is welded to the world if
    ``anchor`` is set, as in the paper; else the policy goes on, and keeps the robot standing.
    ``preset`` is the size of the arm's controller, ``n_neurons`` are those of a hidden unit of the
    policy. ``network_seed`` draws the neurons. ``appearance`` is that of the robot in pictures:
    ``primitive``, or ``menagerie`` for meshes.
    """

    schedule: str | None = None
    digit: int = 8
    anchor: bool = True
    preset: str = "lean"
    n_neurons: int = PolicyOptions.n_neurons
    network_seed: int = 0
    appearance: str = "primitive"

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        if self.preset not in PRESETS:
            raise unknown("preset", self.preset, PRESETS)
        if self.digit not in DIGITS:
            raise unknown("digit", str(self.digit), map(str, DIGITS))
        if self.n_neurons < 2 or self.n_neurons % 2:
            raise UsageError(
                f"n_neurons={self.n_neurons}: a unit has as many neurons for each sign; give an "
                "even number from 2 on"
            )
        if not 0 <= self.network_seed <= LARGEST_SEED:
            raise UsageError(
                f"network_seed={self.network_seed}: a seed must be from 0 to {LARGEST_SEED}"
            )

    @property
    def schedule_file(self) -> Path:
        """Where the schedule is."""
        return SHIPPED if self.schedule is None else Path(self.schedule)

    def load_schedule(self, seconds: float) -> Schedule:
        """The schedule, for a run of at most so many seconds; see `schedule.load`."""
        return load(self.schedule_file, seconds)
