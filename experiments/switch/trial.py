"""A switching run: what it is asked for, and what it leaves."""

import dataclasses
import hashlib
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from spikeport.errors import UsageError
from spikeport.experiments.arm.loop import Recording as ArmRecording
from spikeport.experiments.options import Options
from spikeport.experiments.switch.goals import Goal, find_goals
from spikeport.experiments.switch.schedule import Schedule
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.walk.paths import Path
from spikeport.experiments.walk.recording import Recording
from spikeport.simulator import Simulator


@dataclass(frozen=True)
class SwitchTrial:
    """Settings, schedule and options of a run, which ends with the last phase."""

    settings: SwitchSettings
    schedule: Schedule
    options: Options
    name = "switch"

    @classmethod
    def of(cls, settings: SwitchSettings, options: Options) -> "SwitchTrial":
        """The trial; raises UsageError if its schedule is wrong, or longer than the run."""
        schedule = settings.load_schedule(options.seconds)
        return cls(settings, schedule, dataclasses.replace(options, seconds=schedule.end_s))

    @property
    def recorded(self) -> dict[str, Any]:
        """What the rehearsals depend on, beside the policy."""
        digest = hashlib.sha256(self.schedule.model_dump_json().encode())
        names = ("digit", "anchor")
        chosen = {name: getattr(self.settings, name) for name in names}
        return {"experiment": self.name, "schedule": digest.hexdigest()[:12], **chosen}

    @property
    def analytic(self) -> bool:
        """Whether the exact controllers run, without neurons."""
        return self.options.backend == "analytic"

    def goals(self, seed: int) -> list[Goal]:
        """What the robot is to do; raises UsageError if a path cannot be followed."""
        try:
            return find_goals(self.schedule, self.settings.digit, seed)
        except UsageError as error:
            raise UsageError(f"{self.settings.schedule_file}: {error}") from None


class SwitchRun(NamedTuple):
    """A run that is over."""

    goals: list[Goal]
    paths: list[Path | None]
    """The path of each phase that began, where it was laid down; None where the arm worked."""
    recording: Recording
    arm: ArmRecording
    seen_m: np.ndarray
    """(n, 3) the hand as the arm's task sees it: on its sheet, or from the torso."""
    hands_m: np.ndarray
    """(n, 3) where the hand was in the world."""
    gates: np.ndarray
    """(n_steps, n_actions) 1 for the action that is selected."""
    spikes: dict[str, np.ndarray]
    """(n_steps, n_neurons) spikes of each nucleus, action by action; empty without neurons."""
    fallen_at_s: float | None
    anchored: bool
    """Whether the pelvis was held while the arm worked."""
    sim: Simulator
    wall_s: float
    pictures: tuple[np.ndarray, ...] = ()
    """(height, width, 3) the robot in the middle of each phase; empty without graphics."""
