"""Digit drawing: the right arm draws a digit in the air (paper, sec. 4.1 and Fig. 5)."""

import dataclasses
import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from spikeport.errors import UsageError, unknown
from spikeport.experiments.arm import controller as arm_controller
from spikeport.experiments.arm import digit_reader
from spikeport.experiments.arm import run as arm_run
from spikeport.experiments.arm.draw_figure import draw_figure
from spikeport.experiments.arm.draw_metrics import drawing, metrics
from spikeport.experiments.arm.draw_task import SHORTEST_S, DrawTask, Sheet
from spikeport.experiments.arm.settings import ArmSettings
from spikeport.experiments.arm.strokes import DIGITS
from spikeport.experiments.arm.task import Rehearsal
from spikeport.experiments.arm.trial import ArmRun, ArmTrial
from spikeport.experiments.calibration import Calibration
from spikeport.experiments.closed_loop import BACKENDS
from spikeport.experiments.options import Experiment, Options, Outcome

CHECKED_POINTS = 25
"""Points along each stroke that must be reachable: three centimetres apart at most."""


@dataclass(frozen=True, kw_only=True)
class DrawSettings(ArmSettings):
    """Settings of the experiment, see `ArmSettings`.

    ``digit`` is what is drawn; ``x_m``, ``y_m``, ``z_m`` the centre of the sheet, ``width_m`` and
    ``height_m`` its size (`Sheet`). ``recognise`` says whether a classifier reads the drawing: by
    default where scikit-learn is installed.
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
            if not 0 < getattr(self, key) < math.inf:
                raise UsageError(f"{key}={getattr(self, key):g}: a size must be above 0 and finite")
        for key in ("x_m", "y_m", "z_m"):
            if not math.isfinite(getattr(self, key)):
                raise UsageError(f"{key}={getattr(self, key):g}: a place must be finite")
        if self.recognise:
            digit_reader.require()

    @property
    def sheet(self) -> Sheet:
        """Where the digit is drawn."""
        return Sheet(self.x_m, self.y_m, self.z_m, self.width_m, self.height_m)


@dataclass(frozen=True)
class DrawTrial(ArmTrial):
    """What a drawing run does, and what is made of it."""

    settings: DrawSettings
    name = "draw"

    @property
    def stroke(self) -> np.ndarray:
        """(n, 3) the template."""
        return self.settings.sheet.stroke(self.settings.digit)

    def task(self, hand: np.ndarray) -> DrawTask:
        """The digit."""
        return DrawTask(self.stroke, hand, self.options.seconds)

    def rehearsals(self) -> list[Rehearsal]:
        """All ten digits: one network draws them all."""
        seconds, sheet = self.options.seconds, self.settings.sheet
        return [
            Rehearsal(partial(DrawTask, sheet.stroke(digit), seconds=seconds), seconds, seed=digit)
            for digit in DIGITS
        ]

    @property
    def network_settings(self) -> dict[str, Any]:
        """The sheet besides, and how long a digit takes."""
        sheet = dataclasses.asdict(self.settings.sheet)
        return {**super().network_settings, **sheet, "seconds": self.options.seconds}

    @property
    def goal(self) -> str:
        """The digit."""
        return f"digit {self.settings.digit}"

    def goal_points(self) -> np.ndarray:
        """Points along the stroke."""
        return self.stroke[:: len(self.stroke) // CHECKED_POINTS]

    def metrics(self, run: ArmRun) -> dict[str, Any]:
        """The figures of a run."""
        trace = self.settings.sheet.read(drawing(run.recording).hand)
        read = digit_reader.read_digit(trace) if self._reads else None
        return metrics(run, self.stroke, read)

    @property
    def _reads(self) -> bool:
        asked = self.settings.recognise
        return digit_reader.can_read() if asked is None else asked

    def figure(self, run: ArmRun, result: dict[str, Any]) -> Figure:
        """The paper's Fig. 5."""
        return draw_figure(run, self.settings.sheet, self.stroke, result)

    def trace_since(self, _time_s: float) -> float:
        """The whole drawing."""
        return DrawTask.begin_s


def calibrate(settings: DrawSettings, options: Options) -> Calibration:
    """Refit the controller's decoders where it runs."""
    return arm_controller.calibrate(DrawTrial(settings, options))


def run(settings: DrawSettings, options: Options) -> Outcome:
    """Run the experiment and write its folder."""
    return arm_run.run(DrawTrial(settings, options))


EXPERIMENT = Experiment(
    name=DrawTrial.name,
    summary="the right arm draws a digit",
    settings=DrawSettings,
    run=run,
    backends=BACKENDS,
    seconds=12.0,
    shortest_s=SHORTEST_S,
    calibrate=calibrate,
)
