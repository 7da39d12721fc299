"""Digit drawing: the right arm draws a digit in the air (paper, sec. 4.1 and Fig. 4)."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from spikeport.errors import UsageError, unknown
from spikeport.experiments.arm import digit_reader
from spikeport.experiments.arm.draw_task import SHORTEST_S, DrawTask, Sheet
from spikeport.experiments.arm.figures import draw_figure
from spikeport.experiments.arm.metrics import draw_metrics, drawing
from spikeport.experiments.arm.recording import ArmRun
from spikeport.experiments.arm.region import Rehearsal
from spikeport.experiments.arm.settings import FARTHEST_M, ArmSettings
from spikeport.experiments.arm.strokes import DIGITS
from spikeport.experiments.arm.trial import ArmTrial
from spikeport.experiments.options import BACKENDS, Experiment
from spikeport.experiments.run_folder import Result

CHECKED_POINTS = 25
"""Points along each stroke that must be reachable, at most three cm apart on the default sheet."""


@dataclass(frozen=True, kw_only=True)
class DrawSettings(ArmSettings):
    """Settings of the experiment, see `ArmSettings`.

    ``digit`` is the digit to draw, 0 to 9. ``x_m``, ``y_m`` and ``z_m`` are the centre of the
    upright sheet in front of the robot, ``width_m`` and ``height_m`` its size. If
    ``recognise`` is true, a classifier reads the drawing; by default it does if scikit-learn is
    installed.
    """

    digit: int = 5
    x_m: float = Sheet.x_m
    y_m: float = Sheet.y_m
    z_m: float = Sheet.z_m
    width_m: float = Sheet.width_m
    height_m: float = Sheet.height_m
    recognise: bool | None = None

    def __post_init__(self) -> None:
        """Check the values; UsageError or MissingExtraError says what is wrong."""
        super().__post_init__()
        if self.digit not in DIGITS:
            raise unknown("digit", str(self.digit), map(str, DIGITS))
        for key in ("width_m", "height_m"):
            if not 0 < getattr(self, key) <= FARTHEST_M:
                raise UsageError(
                    f"{key}={getattr(self, key):g}: a size must be above 0 and at most "
                    f"{FARTHEST_M:g} m"
                )
        for key in ("x_m", "y_m", "z_m"):
            if not abs(getattr(self, key)) <= FARTHEST_M:
                raise UsageError(
                    f"{key}={getattr(self, key):g}: a place must be from -{FARTHEST_M:g} to "
                    f"{FARTHEST_M:g} m"
                )
        if self.recognise:
            digit_reader.require()

    @property
    def sheet(self) -> Sheet:
        """The sheet on which the digit is drawn."""
        return Sheet(self.x_m, self.y_m, self.z_m, self.width_m, self.height_m)


class DrawTrial(ArmTrial):
    """A drawing run."""

    settings: DrawSettings
    name = "draw"

    @property
    def stroke(self) -> np.ndarray:
        """The template, (n, 3) in m."""
        return self.settings.sheet.stroke(self.settings.digit)

    def task(self, hand: np.ndarray) -> DrawTask:
        """Return the task of drawing the digit."""
        return DrawTask(self.stroke, hand, self.options.seconds)

    def rehearsals(self) -> list[Rehearsal]:
        """Return a rehearsal of each of the ten digits: one network draws them all."""
        seconds, sheet = self.options.seconds, self.settings.sheet
        return [
            Rehearsal(partial(DrawTask, sheet.stroke(digit), seconds=seconds), seconds, seed=digit)
            for digit in DIGITS
        ]

    @property
    def rehearsed_settings(self) -> dict[str, object]:
        """The sheet and the time of a run."""
        return {**dataclasses.asdict(self.settings.sheet), "seconds": self.options.seconds}

    @property
    def goal(self) -> str:
        """The digit."""
        return f"digit {self.settings.digit}"

    def goal_points(self) -> np.ndarray:
        """Return points along the stroke."""
        checked = np.linspace(0, len(self.stroke) - 1, CHECKED_POINTS).astype(int)
        return np.asarray(self.stroke[checked])

    def trace_since(self, _time_s: float) -> float:
        """Return the time at which the drawing begins."""
        return DrawTask.begin_s

    def metrics(self, run: ArmRun) -> dict[str, object]:
        """Return the figures of a run."""
        trace = self.settings.sheet.project(drawing(run.recording).hand)
        read = digit_reader.read_digit(trace) if self._reads else None
        return draw_metrics(run, self.stroke, read)

    @property
    def _reads(self) -> bool:
        asked = self.settings.recognise
        return digit_reader.can_read() if asked is None else asked

    def figure(self, run: ArmRun, pictures: Sequence[np.ndarray], result: Result) -> Figure:
        """Draw the paper's Fig. 4."""
        return draw_figure(run, self.settings.sheet, self.stroke, pictures, result)


EXPERIMENT = Experiment(
    trial=DrawTrial,
    settings=DrawSettings,
    backends=BACKENDS,
    seconds=12.0,
    shortest_s=SHORTEST_S,
    # One network draws all digits.
    of_run=("digit", "recognise"),
)
