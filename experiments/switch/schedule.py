"""The schedule of the humanoid: phases with utilities and goals, from a TOML file.

The schedules beside this file are shipped; ``switch.toml`` explains the entries of such a file.
"""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from spikeport.errors import UsageError
from spikeport.experiments.arm.draw_task import SHORTEST_S
from spikeport.experiments.options import not_whole
from spikeport.experiments.walk.path_file import FASTEST_M_S, path_files
from spikeport.files import Name, read_model
from spikeport.networks.humanoid import ACTIONS
from spikeport.reading.mismatch import shown
from spikeport.robot.times import ROUNDING_S

SHIPPED = {file.stem: file for file in sorted(Path(__file__).parent.glob("*.toml"))}
"""Schedules by name."""
SHORTEST_PHASE_S = 0.1
SHORTEST_ARM_S = {"digit": SHORTEST_S, "retract": 1.0, "reach": 0.5}
"""The least time of each task of the arm."""
GOALS = {"walk": ("path", "speed_m_s"), "draw": ("arm",)}
"""Keys that describe the goal of an action; the first one is required."""

LEAST_UTILITY = 0.2
"""The least highest utility of a phase: the striatum is silent up to 0.12, and selects nothing."""

Seconds = Annotated[float, Field(ge=0, strict=True)]
Utility = Annotated[float, Field(strict=True)]
Speed = Annotated[float, Field(gt=0, le=FASTEST_M_S, strict=True)]


class _Strictly(BaseModel):
    """Base of all parts of a schedule: it cannot be changed, and has no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Phase(_Strictly):
    """A span of time with its utilities, and the goal of the action with the highest utility.

    ``path`` and ``speed_m_s`` are the goal of walking, as
    `spikeport.experiments.walk.paths.find_path` takes them; ``arm`` is the goal of drawing.
    """

    name: Name
    begin_s: Seconds
    end_s: Seconds
    utilities: dict[str, Utility]
    path: Name | None = None
    speed_m_s: Speed = 0.5
    arm: Literal["digit", "retract", "reach"] | None = None

    @field_validator("end_s")
    @classmethod
    def _is_a_whole_number_of_steps(cls, end_s: float) -> float:
        if why := not_whole(end_s):
            raise ValueError(f"{end_s} {why}")
        return end_s

    @field_validator("utilities")
    @classmethod
    def _are_of_known_actions(cls, utilities: dict[str, float]) -> dict[str, float]:
        for action, utility in utilities.items():
            if action not in ACTIONS:
                known = ", ".join(sorted(ACTIONS))
                raise ValueError(f"unknown action '{action}'; choose from: {known}")
            if not 0 <= utility <= 1:
                raise ValueError(f"'{action}' has utility {utility:g}, limit 0 to 1")
        if not utilities:
            raise ValueError("no action has a utility; give one to the action of this phase")
        values = _of_all_actions(utilities)
        if values.count(max(values)) != 1:
            raise ValueError("no single action has the highest utility; raise one above the others")
        if max(values) < LEAST_UTILITY:
            raise ValueError(
                f"the highest utility is {max(values):g}, and the basal ganglia then select both "
                f"actions or none; raise it to {LEAST_UTILITY:g} or more"
            )
        return utilities

    @model_validator(mode="after")
    def _lasts_long_enough(self) -> "Phase":
        if self.end_s <= self.begin_s:
            raise ValueError(f"end_s {self.end_s:g} is not after begin_s {self.begin_s:g}")
        does, least_s = "a phase", SHORTEST_PHASE_S
        if self.arm:
            does, least_s = f'arm = "{self.arm}"', SHORTEST_ARM_S[self.arm]
        # The difference of two decimal times has a rounding error.
        if self.seconds < least_s - ROUNDING_S:
            raise ValueError(f"lasts {self.seconds:g} s, {does} takes at least {least_s:g} s")
        return self

    @model_validator(mode="after")
    def _has_the_goal_of_its_action(self) -> "Phase":
        goal = GOALS[self.action][0]
        if getattr(self, goal) is None:
            raise ValueError(f"selects '{self.action}', and needs '{goal}'")
        for other in GOALS.keys() - {self.action}:
            for key in GOALS[other]:
                if key in self.model_fields_set:
                    raise ValueError(f"selects '{self.action}', and has no use for '{key}'")
        return self

    @model_validator(mode="after")
    def _has_one_speed(self) -> "Phase":
        if self.path and path_files(self.path) and "speed_m_s" in self.model_fields_set:
            raise ValueError(
                f"speed_m_s {self.speed_m_s:g}: '{self.path}' has times of its own; cure: leave it "
                "out, or change the times"
            )
        return self

    @property
    def seconds(self) -> float:
        """The length, in s."""
        return self.end_s - self.begin_s

    @property
    def action(self) -> str:
        """The action that has the highest utility."""
        return max(self.utilities, key=self.utilities.__getitem__)

    @property
    def values(self) -> tuple[float, ...]:
        """The utilities in the order of `spikeport.networks.humanoid.ACTIONS`; 0 if not named."""
        return _of_all_actions(self.utilities)


def _of_all_actions(utilities: Mapping[str, float]) -> tuple[float, ...]:
    return tuple(utilities.get(action, 0.0) for action in ACTIONS)


class Schedule(_Strictly):
    """Phases one after the other, from 0 s on, without gaps; the arm works in at least one."""

    phases: tuple[Phase, ...]

    @field_validator("phases")
    @classmethod
    def _the_arm_is_used(cls, phases: tuple[Phase, ...]) -> tuple[Phase, ...]:
        if all(phase.arm is None for phase in phases):
            raise ValueError(
                "no phase selects 'draw'; the arm's controller is built for the tasks of such "
                "phases, so add one"
            )
        return phases

    @field_validator("phases")
    @classmethod
    def _follow_each_other(cls, phases: tuple[Phase, ...]) -> tuple[Phase, ...]:
        if phases[0].begin_s != 0:
            raise ValueError(f"'{phases[0].name}' begins at {phases[0].begin_s:g} s, not at 0 s")
        for before, phase in pairwise(phases):
            if phase.begin_s != before.end_s:
                fault = "overlaps" if phase.begin_s < before.end_s else "leaves a gap after"
                raise ValueError(
                    f"'{phase.name}' begins at {phase.begin_s:g} s and {fault} '{before.name}', "
                    f"which ends at {before.end_s:g} s"
                )
        return phases

    @property
    def end_s(self) -> float:
        """The time at which the last phase ends."""
        return self.phases[-1].end_s


def load(path: Path, seconds: float) -> Schedule:
    """Load the schedule in a TOML file, for a run of at most ``seconds``.

    Raises
    ------
    UsageError
        If the file cannot be read or is no schedule, or a phase ends after the run.
    """
    schedule = read_model(path, Schedule, "schedule")
    for phase in schedule.phases:
        if phase.end_s > seconds:
            raise UsageError(
                f"{path}: phase '{shown(phase.name)}' ends at {phase.end_s:g} s, the run "
                f"at {seconds:g} s; cure: --seconds {schedule.end_s:g}, or shorter phases"
            )
    return schedule
