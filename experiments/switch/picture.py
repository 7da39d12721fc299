"""What is drawn into pictures of the humanoid: the paths it walks, and where its hand went."""

import numpy as np

from spikeport.experiments.arm.draw_task import DrawTask
from spikeport.experiments.pictures import Marks
from spikeport.experiments.switch.phases import within
from spikeport.experiments.switch.trial import SwitchRun
from spikeport.robot.render import Mark

CAMERA = "track"
PATH_RGBA = (0.15, 0.15, 0.18, 1.0)
HAND_RGBA = (0.78, 0.06, 0.18, 1.0)
PATH_DT_S = 0.2
TRACE_STEPS = 6
MOST_MARKS = 1500


def middles(run: SwitchRun) -> list[int]:
    """The physics step in the middle of each phase that began."""
    phases = [goal.phase for goal in run.goals[: len(run.paths)]]
    steps = [np.flatnonzero(within(run.recording.time_s, phase)) for phase in phases]
    return [int(now[len(now) // 2]) for now in steps if len(now)]


def switch_marks(run: SwitchRun) -> Marks:
    """The paths of all phases, and where the hand was in the world while it drew."""
    path, trace, numbers = _paths(run), *_traces(run)

    def marks(end: int) -> list[Mark]:
        drawn = int(np.searchsorted(numbers, end))
        return [*path, *trace[max(0, drawn - MOST_MARKS + len(path)) : drawn]]

    return marks


def _paths(run: SwitchRun) -> list[Mark]:
    found = []
    for goal, path in zip(run.goals, run.paths, strict=False):
        if path is not None:
            for t in np.arange(0, goal.phase.seconds, PATH_DT_S):
                x, y = path.at(t)[:2]
                found.append(Mark((x, y, 0.012), 0.012, PATH_RGBA))
    return found[:MOST_MARKS]


def _traces(run: SwitchRun) -> tuple[list[Mark], np.ndarray]:
    """Marks of the hand, and the physics step of each."""
    drawn = np.zeros(len(run.hands_m), bool)
    for goal in run.goals:
        if goal.phase.arm == "digit":
            time_s = run.recording.time_s
            drawn |= within(time_s, goal.phase) & (time_s > goal.phase.begin_s + DrawTask.begin_s)
    steps = np.flatnonzero(drawn)[::TRACE_STEPS]
    return [Mark(tuple(run.hands_m[step]), 0.004, HAND_RGBA) for step in steps], steps
