"""What every experiment can be told, and how it reports progress."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import nengo

from spikeport.compile.verdict.report import Report
from spikeport.experiments.calibration import Calibration
from spikeport.hardware_models.activity import Activity

Progress = Callable[[str, float | None], None]
"""Called with what is being done, and the share that is done (None where that is not known)."""


def silent(_what: str, _share: float | None) -> None:
    """Report no progress."""


@dataclass(frozen=True)
class Options:
    """Options all experiments share.

    ``pipeline`` is that of the compile, by default the chip's; ``seed`` draws what varies from run
    to run of the same controller; ``folder`` is where the run is written.
    """

    folder: Path
    seconds: float
    backend: str = "native"
    chip: str = "loihi"
    pipeline: str | None = None
    seed: int = 0
    video: bool = False
    progress: Progress = field(default=silent, compare=False)
    command: tuple[str, ...] = ()

    @property
    def substrate(self) -> dict[str, str]:
        """What neurons run on: with equal ones they do the same, on either backend with a chip."""
        if self.backend == "reference":
            return {"chip": "none", "passes": "none"}
        return {"chip": str(self.chip), "passes": self.pipeline or "by default"}


class Outcome(NamedTuple):
    """What a run leaves: what ``result.json`` holds, the compile's report, the chip's counts."""

    result: dict[str, Any]
    report: Report | None
    activity: Activity


@dataclass(frozen=True)
class Experiment:
    """An experiment of the paper: its name, what it shows, its settings and how to run it."""

    name: str
    summary: str
    settings: type
    run: Callable[[Any, Options], Outcome]
    backends: tuple[str, ...]
    seconds: float
    """Simulated time where none is asked for."""
    shortest_s: float
    """The shortest time it can simulate."""
    pipeline: str | None = None
    """The passes of its compile where none are asked for; None for the chip's."""
    calibrate: Callable[[Any, Options], Calibration] | None = None
    """Refits its decoders to what the neurons do on a backend; None where it cannot."""
    network: Callable[[Any, Options], nengo.Network] | None = None
    """What it runs, to be compiled; the image is that of the run."""
    check: Callable[[Any, Options], None] | None = None
    """Refuses what a run would refuse, without one; None where the settings refuse it all."""

    def passes(self, asked: str | None) -> str | None:
        """The passes of its compile: those asked for, of which "" is none, or else its own."""
        return self.pipeline if asked is None else asked
