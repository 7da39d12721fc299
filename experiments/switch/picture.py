"""The marks in pictures of the humanoid: the paths it walks, and the trace of its hand."""

import itertools
from bisect import bisect

import numpy as np

from spikeport.constants import DT_S
from spikeport.experiments.pictures import Caption, Captions, Marks
from spikeport.experiments.switch.metrics import pen_down, within
from spikeport.experiments.switch.recording import SwitchRun
from spikeport.experiments.walk.figure import TRACE
from spikeport.experiments.walk.marks import path_marks
from spikeport.experiments.walk.port import LEAD_S
from spikeport.networks.humanoid import ACTIONS
from spikeport.robot.render import Mark
from spikeport.robot.times import PHYSICS_DT_S, ROUNDING_S

COLOURS = dict(zip(ACTIONS, (TRACE, "#c8102e"), strict=True))
HAND_RGBA = (1.0, 0.2, 0.15, 1.0)
"""A bright colour, to stand out in front of the robot."""
HAND_M = 0.007
TRACE_STEPS = 6
MOST_MARKS = 1500


def middles(run: SwitchRun) -> list[int]:
    """Return the physics step in the middle of each phase that began."""
    phases = [goal.phase for goal in run.goals[: len(run.paths)]]
    steps = [np.flatnonzero(within(run.recording.time_s, phase)) for phase in phases]
    return [int(now[len(now) // 2]) for now in steps if len(now)]


def switch_marks(run: SwitchRun) -> Marks:
    """Mark the paths of all phases, and the hand's places in the world while it drew."""
    path, trace, numbers = _paths(run), *_traces(run)

    def marks(end: int) -> list[Mark]:
        # Marks of the hand up to this pose.
        drawn = int(np.searchsorted(numbers, end))
        return [*path, *trace[max(0, drawn - MOST_MARKS + len(path)) : drawn]]

    return marks


def switch_captions(run: SwitchRun) -> Captions:
    """Return captions with phase and selection, in the colour of the selected action."""
    begins_s = [goal.phase.begin_s for goal in run.goals]

    def caption(end: int) -> Caption:
        time_s = run.recording.time_s[end - 1]
        phase = run.goals[bisect(begins_s, time_s + ROUNDING_S) - 1].phase
        wanted = ", ".join(f"{action} {utility:g}" for action, utility in phase.utilities.items())
        # Gates are sampled at the controller's steps, poses at those of the physics. The number of
        # the pose counts: in real time the robot's clock may be ahead of the controller's.
        step = (end - 1) * round(PHYSICS_DT_S / DT_S)
        selected = ACTIONS[int(run.gates[step].argmax())]
        return Caption(
            f"{time_s:5.1f} s   {phase.name}   utilities: {wanted}   selected: {selected}",
            COLOURS[selected],
        )

    return caption


def _paths(run: SwitchRun) -> list[Mark]:
    pairs = zip(run.goals, run.paths, strict=False)
    found = [
        path_marks(path, goal.phase.seconds + LEAD_S, run.floor)
        for goal, path in pairs
        if path is not None
    ]
    return [*itertools.chain(*found)][:MOST_MARKS]


def _traces(run: SwitchRun) -> tuple[list[Mark], np.ndarray]:
    """Return marks of the hand, and the physics step of each."""
    drawn = [pen_down(run, goal) for goal in run.goals]
    steps = np.flatnonzero(np.any(drawn, axis=0))[::TRACE_STEPS]
    return [Mark(tuple(run.hands_m[step]), HAND_M, HAND_RGBA) for step in steps], steps
