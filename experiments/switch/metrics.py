"""The metrics of a switching run, phase by phase.

A phase is a success if the robot stands to its end, the gate of its action alone is open from
`LATEST_SWITCH_S` on, and

- walking, the pelvis stays near the path, and ends near the reference;
- drawing, the digit is read as the one asked for, and its shape is near the template;
- retracting, the hand ends near where it hangs;
- reaching, it reaches a target.
"""

from typing import NamedTuple

import numpy as np

from spikeport.constants import DT_S
from spikeport.experiments.arm import digit_reader
from spikeport.experiments.arm.draw_task import Sheet, pen_is_down
from spikeport.experiments.arm.metrics import shape_error
from spikeport.experiments.arm.reach_task import MIN_JUMP_M
from spikeport.experiments.curves import rms
from spikeport.experiments.run_folder import Result
from spikeport.experiments.switch.gate import OPEN
from spikeport.experiments.switch.goals import Goal, hanging_hand
from spikeport.experiments.switch.recording import SwitchRun
from spikeport.experiments.switch.schedule import Phase
from spikeport.experiments.walk.paths import WalkPath
from spikeport.experiments.walk.recording import WalkRecording
from spikeport.networks.humanoid import ACTIONS
from spikeport.robot.times import PHYSICS_DT_S, ROUNDING_S

# The limits of success; docs/switch.md has them as a table.
LATEST_SWITCH_S = 0.045
LARGEST_PATH_ERROR_M = 0.2
FARTHEST_BEHIND_M = 1.0
LARGEST_SHAPE_ERROR_M = {True: 0.008, False: 0.012}
"""The limits for an anchored robot, and for one that is not anchored."""
LARGEST_HAND_ERROR_M = 0.04


class PhaseJudgement(NamedTuple):
    """The judgement of a phase, and the figures that it rests on."""

    good: bool
    figures: dict[str, object]


def metrics(run: SwitchRun) -> dict[str, object]:
    """Return all metrics of a run.

    - ``falls``: 1 if the robot fell, which ends the run, else 0; ``fallen_at_s``: when;
    - ``phases``: see `phase_metrics`;
    - ``phases_done``: how many of these were successful;
    - ``recognised_as``: the digit a classifier reads in the first drawing, None where there is
      none, or no classifier;
    - ``shape_error_rms_m``: of all drawings together, None where there is none;
    - ``spikes_by_nucleus``: of the action selection;
    - ``spikes_per_second``: of all neurons;
    - ``readout_spikes``: spikes of read-outs, 0 unless one saturated; None without a chip;
    - ``real_time_factor``: simulated over wall-clock time of the loop, physics included.
    """
    sim, phases = run.sim, phase_metrics(run)
    return {
        "falls": int(run.fallen_at_s is not None),
        "fallen_at_s": run.fallen_at_s,
        "phases": phases,
        "phases_done": sum(phase["success"] for phase in phases),
        "recognised_as": next((p["recognised_as"] for p in phases if "recognised_as" in p), None),
        "shape_error_rms_m": _shape_error(run),
        "spikes_by_nucleus": {name: int(spikes.sum()) for name, spikes in run.spikes.items()},
        "spikes_per_second": sim.activity.totals()["spikes"] / sim.time,
        "readout_spikes": None if sim.image is None else sim.activity.readout_spikes,
        "real_time_factor": sim.time / run.wall_s,
    }


def _shape_error(run: SwitchRun) -> float | None:
    """Return the rms distance in m of all drawings together from their templates."""
    errors_m = np.concatenate([_shape_errors(run, goal) for goal in run.goals])
    return float(rms(errors_m)) if len(errors_m) else None


def phase_metrics(run: SwitchRun) -> list[Result]:
    """Return for each phase its name, ``success``, ``switching_time_s``, and its errors.

    The switching time lasts from the beginning of the phase until the gate of its action alone is
    open, and stays so for the rest of the phase. A phase after a fall has no errors.
    """
    return [_phase_figures(run, number) for number in range(len(run.goals))]


def _phase_figures(run: SwitchRun, number: int) -> Result:
    phase = run.goals[number].phase
    now = within(run.recording.time_s, phase)
    if not now.any():
        return {"name": phase.name, "success": False, "switching_time_s": None}
    path = run.paths[number]
    measured = _worked(run, number, now) if path is None else _walked(path, run.recording, now)
    begin_s, end_s = by_controller(run.recording.time_s, phase.begin_s, phase.end_s)
    switching_time_s = switched_after_s(run.gates, phase.action, begin_s, end_s)
    stood = run.fallen_at_s is None or run.fallen_at_s > phase.end_s
    return {
        "name": phase.name,
        "success": stood and measured.good and switching_time_s <= LATEST_SWITCH_S,
        "switching_time_s": switching_time_s,
        **measured.figures,
    }


def within(time_s: np.ndarray, phase: Phase) -> np.ndarray:
    """Return whether times (n,) are in a phase."""
    return np.asarray((time_s > phase.begin_s - ROUNDING_S) & (time_s < phase.end_s - ROUNDING_S))


def pen_down(run: SwitchRun, goal: Goal) -> np.ndarray:
    """Return whether a phase drew on its sheet at each physics step, (n,)."""
    time_s, phase = run.recording.time_s, goal.phase
    drawing = pen_is_down(time_s - phase.begin_s) & (phase.arm == "digit")
    return np.asarray(within(time_s, phase) & drawing)


def drawn(run: SwitchRun, goal: Goal) -> np.ndarray:
    """Return the places (n, 3) of the hand on its sheet while a phase drew, in m."""
    return np.asarray(run.local_m[pen_down(run, goal)])


def _shape_errors(run: SwitchRun, goal: Goal) -> np.ndarray:
    """Return (n,) distances in m of a drawing from its template."""
    return shape_error(goal.stroke, drawn(run, goal))


def by_controller(time_s: np.ndarray, *moments_s: float) -> list[float]:
    """Return moments of a run in s of its controller, from the times (n,) of the physics steps.

    They only differ in real time, where a robot has a clock of its own.
    """
    n = len(time_s)
    # The controller's time is the number of the step, up to the end of the last one.
    times_s = np.append(time_s, time_s[-1] + PHYSICS_DT_S)
    found: list[float] = np.interp(moments_s, times_s, PHYSICS_DT_S * np.arange(n + 1)).tolist()
    return found


def switched_after_s(gates: np.ndarray, action: str, begin_s: float, end_s: float) -> float:
    """Return the time in s from which gates (n, actions) are open for a phase's action alone.

    Row i has the gates (i + 1) steps after the beginning of the run.
    """
    begin = round(begin_s / DT_S)
    # The first row is of the moment in which the phase begins; the run's beginning has no row.
    first = max(begin - 1, 0)
    during = gates[first : round(end_s / DT_S)]
    wanted = np.arange(len(ACTIONS)) == ACTIONS.index(action)
    wrong = np.flatnonzero(((during > OPEN) != wanted).any(axis=1))
    after = first + 1 - begin  # of the first row, in steps
    return float(after + wrong[-1] + 1) * DT_S if len(wrong) else 0.0


def _walked(path: WalkPath, recording: WalkRecording, now: np.ndarray) -> PhaseJudgement:
    place_m, reference_m = recording.position_m[now], recording.reference[now, :2]
    error_m = float(rms(path.distances_m(place_m)))
    behind_m = float(np.linalg.norm(reference_m[-1] - place_m[-1]))
    good = error_m <= LARGEST_PATH_ERROR_M and behind_m <= FARTHEST_BEHIND_M
    return PhaseJudgement(good, {"path_error_rms_m": error_m, "behind_m": behind_m})


def _worked(run: SwitchRun, number: int, now: np.ndarray) -> PhaseJudgement:
    measure = {"digit": _drawn, "retract": _retracted, "reach": _reached}
    good, figures = measure[run.goals[number].phase.arm or ""](run, number, now)
    place_m = run.recording.position_m[now]
    moved_m = np.linalg.norm(place_m - place_m[0], axis=1).max()
    return PhaseJudgement(good, {**figures, "pelvis_moved_m": float(moved_m)})


def _drawn(run: SwitchRun, number: int, _now: np.ndarray) -> PhaseJudgement:
    goal = run.goals[number]
    trace = drawn(run, goal)
    if not len(trace):
        return PhaseJudgement(False, {"shape_error_rms_m": None, "recognised_as": None})
    error_m = float(rms(_shape_errors(run, goal)))
    digit = digit_reader.read_digit(Sheet().project(trace)) if digit_reader.can_read() else None
    # None where no classifier is installed: then the shape alone decides.
    good = error_m <= LARGEST_SHAPE_ERROR_M[run.anchored] and digit in (goal.digit, None)
    return PhaseJudgement(good, {"shape_error_rms_m": error_m, "recognised_as": digit})


def _retracted(run: SwitchRun, _number: int, now: np.ndarray) -> PhaseJudgement:
    error_m = float(np.linalg.norm(run.arm.hand[now][-1] - hanging_hand()))
    return PhaseJudgement(error_m <= LARGEST_HAND_ERROR_M, {"hand_error_m": error_m})


def _reached(run: SwitchRun, _number: int, now: np.ndarray) -> PhaseJudgement:
    # A target jumps only when it was reached; half the least jump separates jumps from sway.
    moved_m = np.linalg.norm(np.diff(run.arm.target[now], axis=0), axis=1)
    targets = int(np.count_nonzero(moved_m > MIN_JUMP_M / 2))
    return PhaseJudgement(targets > 0, {"targets_reached": targets})
