"""How long each step of a run takes, from exact counts and a calibration's times per event."""

from typing import Literal, NamedTuple, get_args

import numpy as np

from spikeport.errors import UsageError
from spikeport.hardware_models import events
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.calibration import EnergyCalibration, Times
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.estimate import Estimate, at_least_zero, merge_sources, zero
from spikeport.hardware_models.topology import chip_of, messages_between_chips, tiles_used

EVENTS = (
    events.UPDATE_ACTIVE,
    events.UPDATE_INACTIVE,
    events.SYNAPTIC_OPERATION,
    events.SPIKE,
    events.MESSAGE_IN,
    events.LEARNING_UPDATE,
)
Bound = Literal["value", "low", "high"]


class StepTimes(NamedTuple):
    """T_step of each step and its bounds, each (n_steps,) in s; NaN where a bound is not known."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


def step_times(activity: Activity, chip: ChipModel, calibration: EnergyCalibration) -> StepTimes:
    """Time of each step: of the slowest core or chip's link, and the barrier after it.

        T_step = max(max over cores T_core, T_between) + t_barrier(tiles)

    See `core_times`, `between_chips` and `barrier`. The tiles are those that hold the activity's
    cores. A part without public figure is left out, which leaves no upper bound.

    Raises
    ------
    UsageError
        The activity has no steps or no cores.
    CompileError
        More cores are in use than the chip's mesh has.
    """
    if activity.spikes.size == 0:
        raise UsageError(
            f"no time or energy in {activity.n_steps} steps of {len(activity.cores)} cores; "
            "run at least one step of a network with ensembles on the chip"
        )
    wait = barrier(tiles_used(len(activity.cores), chip), calibration) or at_least_zero("s")
    links = between_chips(activity, chip, calibration) or at_least_zero("s")
    return StepTimes(
        *(
            np.maximum(
                core_times(activity, calibration.times, bound).max(axis=1),
                _number(getattr(links, bound)),
            )
            + _number(getattr(wait, bound))
            for bound in get_args(Bound)
        )
    )


def core_times(activity: Activity, times: Times, bound: Bound) -> np.ndarray:
    """Time each core takes for its events, one after the other.

        T_core = n_act t_act + n_inact t_inact + n_syn t_syn + n_spk t_spk + n_in t_in
                 + n_learn t_learn

    Parameters
    ----------
    activity : Activity
        The counts n.
    times : Times
        The times t.
    bound : {"value", "low", "high"}
        Which of each time to take.

    Returns
    -------
    times : (n_steps, n_cores) float array
        T_core, in s; NaN where the bound is not known.
    """
    total = np.zeros(activity.spikes.shape)
    for event in happened(activity):
        figure = getattr(times, event.name)
        time = at_least_zero("s") if figure is None else figure.estimate
        total += event.per_step(activity) * _number(getattr(time, bound))
    return total


def happened(activity: Activity) -> list[events.OnCore]:
    """The kinds of event that take a core time and happened at least once."""
    return [event for event in EVENTS if event.per_step(activity).any()]


def between_chips(
    activity: Activity, chip: ChipModel, calibration: EnergyCalibration
) -> Estimate | None:
    """Mean time per step of the messages that leave the busiest chip, in s, one after the other.

        T_between = max over chips N_leaving t_message / n_steps

    Messages between cores are counted over the whole run, hence the mean. None where there are such
    messages and no public figure.
    """
    leaving = np.bincount(
        chip_of(len(activity.cores), chip), weights=messages_between_chips(activity.messages, chip)
    )
    figure = calibration.times.message_between_chips
    if not leaving.any():
        return zero("s")
    if figure is None:
        return None
    return figure.estimate.scaled(float(leaving.max()) / activity.n_steps)


def barrier(tiles: int, calibration: EnergyCalibration) -> Estimate | None:
    """Time of the barrier that ends a step, in s; None where there is no public figure.

    Interpolated linearly between the numbers of tiles that have a figure. Below the fewest and
    above the most it stays at theirs, which for more tiles may be too short.
    """
    points = calibration.barrier
    if not points:
        return None
    at = [point.tiles for point in points]
    value, low, high = (
        float(np.interp(tiles, at, [_number(getattr(point, bound)) for point in points]))
        for bound in ("value", "low", "high")
    )
    source = merge_sources(point.estimate.source for point in points)
    return Estimate(value, known(low), known(high), "s", source)


def known(bound: float) -> float | None:
    """A bound as estimates have it: None, not NaN, where it is not known."""
    return None if np.isnan(bound) else float(bound)


def _number(bound: float | None) -> float:
    return np.nan if bound is None else bound
