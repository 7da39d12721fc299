"""Times of the steps of a run, from exact counts and a calibration's times per event."""

from typing import Literal, NamedTuple, get_args

import numpy as np

from spikeport.errors import UsageError
from spikeport.hardware_models import events
from spikeport.hardware_models.activity import PER_RUN, PER_STEP, Activity, Folded
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
LINK, BUS = -1, -2
"""Parts in the place of a core: the links between chips, and the bus of a chip."""
Bound = Literal["value", "low", "high"]


class StepTimes(NamedTuple):
    """T_step of each step and its bounds, each (n_kept,) in s; NaN where a bound is not known."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


class TimeSums(NamedTuple):
    """Sums and maxima over steps.

    Attributes
    ----------
    total_s, worst_s : (3,) array
        Sum and maximum of T_step, as value, low and high; NaN where a bound is not known.
    period_s : float
        Sum of max(T_step, dt), at the value.
    worst_step : int
        The longest step, counted from the first.
    limiting_core : int
        The core that takes longest in it; `LINK` or `BUS` where messages there take longer.
    """

    total_s: np.ndarray
    worst_s: np.ndarray
    period_s: float
    worst_step: int
    limiting_core: int

    def then(self, later: "TimeSums", n_steps: int) -> "TimeSums":
        """Return the sums over these ``n_steps`` steps and later ones."""
        # The first of several steps that take as long counts, as with `argmax` in a run that is
        # not folded.
        longer = later.worst_s[0] > self.worst_s[0]
        return TimeSums(
            self.total_s + later.total_s,
            np.maximum(self.worst_s, later.worst_s),
            self.period_s + later.period_s,
            n_steps + later.worst_step if longer else self.worst_step,
            later.limiting_core if longer else self.limiting_core,
        )


def time_sums(activity: Activity, chip: ChipModel, calibration: EnergyCalibration) -> TimeSums:
    """Return sums and maxima of the times of all steps; see `step_times`.

    Raises
    ------
    UsageError
        The activity has no steps or no cores, or its folded steps are for another chip or lack
        times of this calibration.
    CompileError
        More cores are in use than the chip's mesh has.
    """
    if not activity.n_steps or not activity.cores:
        raise UsageError(
            f"no time or energy in {activity.n_steps} steps of {len(activity.cores)} cores; "
            "run at least one step of a network with ensembles on the chip"
        )
    before = activity.folded
    if before is None:
        return _kept_sums(activity, chip, calibration)
    _check_folded(before, chip, calibration)
    past = before.times[calibration.name]
    if not len(activity.spikes):
        return past
    return past.then(_kept_sums(activity.kept, chip, calibration), before.n_steps)


def _check_folded(before: Folded, chip: ChipModel, calibration: EnergyCalibration) -> None:
    """Raise an error if steps were folded without the times of a chip and a calibration."""
    if before.chip != chip:
        other = before.chip
        held = "without times" if other is None else f"with times for chip '{other.name}' but not"
        raise UsageError(
            f"only sums of the first {before.n_steps:,} steps were kept, {held} for chip "
            f"'{chip.name}'; run the network for chip '{chip.name}', or fewer steps"
        )
    if calibration not in chip.calibrations:
        raise UsageError(
            f"only sums of the first {before.n_steps:,} steps were kept, without times of "
            f"calibration '{calibration.name}', which chip '{chip.name}' does not have; run fewer "
            "steps, or add the calibration to the chip's file"
        )


def _kept_sums(activity: Activity, chip: ChipModel, calibration: EnergyCalibration) -> TimeSums:
    times = step_times(activity, chip, calibration)
    worst = int(times.value.argmax())
    by_core = core_times(activity, calibration.times, "value")[worst]
    on_bus = bus_times(activity, chip, calibration.times, "value")[worst]
    on_link = link_times(activity, chip, calibration.times, "value")[worst]
    return TimeSums(
        np.sum(times, axis=1),
        np.max(times, axis=1),
        # Real time: a step that ends early waits for the clock.
        float(np.maximum(times.value, activity.dt_s).sum()),
        worst,
        _limiting(by_core, on_bus, on_link),
    )


def _limiting(by_core_s: np.ndarray, on_bus_s: float, on_link_s: float) -> int:
    """Return the slowest core, or `LINK` or `BUS` if messages there take longer."""
    if max(on_bus_s, on_link_s) <= by_core_s.max():
        return int(by_core_s.argmax())
    return LINK if on_link_s >= on_bus_s else BUS


def fold(activity: Activity, chip: ChipModel | None) -> Folded:
    """Return sums over all steps of an activity, from which energy and time follow as before.

    On ``chip`` they stay the same, except for the last bits of sums. Messages between the chips of
    a board are spread over the steps of the activity, as by `link_times`.
    """
    times = {}
    if chip is not None and activity.cores:
        times = {c.name: time_sums(activity, chip, c) for c in chip.calibrations}
    sums = {name: activity.over_steps(name) for name in PER_STEP}
    sums |= {name: getattr(activity, name) for name in PER_RUN}
    sent = activity.from_host
    return Folded(activity.n_steps, sums, chip, times, sent.total, sent.most)


def step_times(activity: Activity, chip: ChipModel, calibration: EnergyCalibration) -> StepTimes:
    """Return the time of each kept step: of the slowest core, link or bus, plus a barrier.

        T_step = max(max over cores T_core, T_link, T_bus) + t_barrier(tiles)

    See `core_times`, `link_times`, `bus_times` and `barrier`. The tiles are those that hold the
    activity's cores. A part without public figure is left out, which leaves no upper bound.

    Raises
    ------
    CompileError
        More cores are in use than the chip's mesh has.
    """
    # A part without a figure takes at least zero: the value stays, the upper bound is lost.
    wait = barrier(tiles_used(len(activity.cores), chip), calibration) or at_least_zero("s")
    return StepTimes(
        *(
            np.maximum.reduce(
                [
                    core_times(activity, calibration.times, bound).max(axis=1),
                    bus_times(activity, chip, calibration.times, bound),
                    link_times(activity, chip, calibration.times, bound),
                ]
            )
            + _number(getattr(wait, bound))
            for bound in get_args(Bound)
        )
    )


def core_times(activity: Activity, times: Times, bound: Bound) -> np.ndarray:
    """Return the time each core takes for its events, one after the other.

        T_core = n_act t_act + n_inact t_inact + n_syn t_syn + n_spk t_spk + n_in t_in
                 + n_learn t_learn

    Parameters
    ----------
    activity : Activity
        The counts n.
    times : Times
        The times t.
    bound : {"value", "low", "high"}
        The end of each time's range to take.

    Returns
    -------
    times : (n_kept, n_cores) float array
        T_core, in s; NaN where the bound is not known.
    """
    total = np.zeros(activity.spikes.shape)
    for event in core_events(activity):
        total += event.per_step(activity) * _number(getattr(_time(event, times), bound))
    return total


def _time(event: events.OnCore, times: Times) -> Estimate:
    """Return the time of an event; without a public figure it is at least zero."""
    figure = getattr(times, event.name)
    return at_least_zero("s") if figure is None else figure.estimate


def bus_times(activity: Activity, chip: ChipModel, times: Times, bound: Bound) -> np.ndarray:
    """Return the time of each kept step's messages on the bus of the busiest chip, (n_kept,).

        T_bus = max over chips N_in t_bus

    It is 0 where the cores of a chip share no bus.
    """
    figure = times.message_on_bus
    if figure is None:
        return np.zeros(len(activity.spikes))
    n_cores, on_one = len(activity.cores), chip.limits.cores.count
    # Cores beyond those of the only chip would share its bus, too.
    first = np.arange(0, n_cores, on_one if chip.limits.chips.count > 1 else n_cores)
    messages = np.add.reduceat(activity.messages_in, first, axis=1).max(axis=1)
    result: np.ndarray = messages * _number(getattr(figure.estimate, bound))
    return result


def link_times(activity: Activity, chip: ChipModel, times: Times, bound: Bound) -> np.ndarray:
    """Return the time of each kept step's messages on the link of the busiest chip, (n_kept,).

        T_link = max over chips N_leaving t_message

    Messages between cores are counted over the whole run, or over the steps folded at once.
    Messages that leave a chip are taken to be spread over these steps as those that arrive on the
    other chips are. At the upper bound, as many leave the chip in a step as arrive on the others,
    if so many leave it at all; at the lower bound, as many as must, since no more can arrive on the
    others in all other steps.
    """
    leaving, longest = _leaving(activity, chip), np.zeros(len(activity.spikes))
    if not leaving.any():
        return longest
    figure = times.message_between_chips
    one_s = _number(getattr(at_least_zero("s") if figure is None else figure.estimate, bound))
    on = chip_of(len(activity.cores), chip)
    for number in np.flatnonzero(leaving):
        arriving, left = activity.messages_in[:, on != number].sum(axis=1), leaving[number]
        evenly = np.full(len(arriving), 1 / len(arriving))
        share = arriving / arriving.sum() if arriving.any() else evenly
        messages = left * share
        if bound == "high":
            messages = np.maximum(messages, np.minimum(arriving, left))
        elif bound == "low":
            messages = np.minimum(messages, np.maximum(left - (arriving.sum() - arriving), 0))
        longest = np.maximum(longest, messages * one_s)
    return longest


def _leaving(activity: Activity, chip: ChipModel) -> np.ndarray:
    """Return the messages of the whole run that leave each chip, (n_chips,)."""
    leaving = messages_between_chips(activity.messages, chip)
    return np.bincount(chip_of(len(activity.cores), chip), weights=leaving)


def core_events(activity: Activity) -> list[events.OnCore]:
    """Return the kinds of event that take time on a core and happened at least once."""
    # An event that never happened must not remove the upper bound if it has no figure.
    return [event for event in EVENTS if activity.over_steps(event.counts).any()]


def mean_core_time(activity: Activity, calibration: EnergyCalibration, core: int) -> Estimate:
    """Return the mean time of a step on one core, in s: the mean of `core_times`, with its bounds.

    A part without public figure is left out, which leaves no upper bound.
    """
    time = zero("s")
    for event in core_events(activity):
        count = float(activity.over_steps(event.counts)[core])
        if count:
            time += _time(event, calibration.times).scaled(count)
    return time.scaled(1 / activity.n_steps)


def between_chips(
    activity: Activity, chip: ChipModel, calibration: EnergyCalibration
) -> Estimate | None:
    """Return the mean time in a step, in s, of the messages that leave the busiest chip in turn.

        T_between = max over chips N_leaving t_message / n_steps

    None where there are such messages and no public figure.
    """
    # The links of different chips work at the same time: the busiest decides.
    leaving = _leaving(activity, chip)
    figure = calibration.times.message_between_chips
    if not leaving.any():
        return zero("s")
    if figure is None:
        return None
    return figure.estimate.scaled(float(leaving.max()) / activity.n_steps)


def barrier(tiles: int, calibration: EnergyCalibration) -> Estimate | None:
    """Return the time of the barrier that ends a step, in s; None where there is no public figure.

    It is interpolated linearly between the numbers of tiles that have a figure, and constant below
    the fewest and above the most; for more tiles it may be too short.
    """
    points = calibration.barrier
    if not points:
        return None
    at = [point.tiles for point in points]
    value, low, high = (
        float(np.interp(tiles, at, [_number(getattr(point, bound)) for point in points]))
        for bound in get_args(Bound)
    )
    source = merge_sources(point.estimate.source for point in points)
    return Estimate(value, known(low), known(high), "s", source)


def known(bound: float) -> float | None:
    """Return a bound as estimates have it: None, not NaN, where it is not known."""
    return None if np.isnan(bound) else float(bound)


def _number(bound: float | None) -> float:
    # NaN stays NaN in sums and maxima, so that a bound is lost where any part of it is.
    return np.nan if bound is None else bound
