"""The mean and the longest step of a run, against real time."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.calibration import EnergyCalibration
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.estimate import Estimate, merge_sources, plain
from spikeport.hardware_models.step_time import (
    BUS,
    LINK,
    barrier,
    between_chips,
    core_events,
    known,
    mean_core_time,
    time_sums,
)
from spikeport.hardware_models.topology import tiles_used


@dataclass(frozen=True)
class CoreTime:
    """The mean time of a step on one core, in s, without the barrier."""

    core: str
    time_step: Estimate


SHARED = {LINK: "a link between chips", BUS: "a bus"}
"""The names of parts that cores share."""
NOT_MODELLED = (
    "waiting for messages on the links between tiles",
    "sending of messages",
    "input and output of the host",
)


@dataclass(frozen=True)
class TimingReport:
    """The times of a run's steps.

    Parameters
    ----------
    calibration : str
        The name of the calibration with these times.
    n_steps, dt_s : int, float
        Number of steps of the run, and the time each stands for, in s.
    mean, worst : Estimate
        T_step, in s: its mean and its maximum over the run.
    worst_step : int
        The longest step.
    limiting_core : str
        The core that takes longest in it, or a link or bus if its messages take longer.
    fits : bool
        True if the longest step takes no longer than ``dt_s``.
    fits_at_high : bool or None
        True if its upper bound takes no longer, either; None where that bound is not known.
    barrier : Estimate or None
        The barrier's share of each step, in s; None: no public figure.
    between_chips : Estimate or None
        The share of messages between chips in a step, in s; None: no public figure.
    cores : tuple of CoreTime
        The mean time of a step, core by core.
    missing : tuple of str
        Items that happened and have no public figure; their time is left out.
    not_modelled : tuple of str
        Items that take time on a chip and are not in this model, and so are left out as well.
    """

    calibration: str
    n_steps: int
    dt_s: float
    mean: Estimate
    worst: Estimate
    worst_step: int
    limiting_core: str
    fits: bool
    fits_at_high: bool | None
    barrier: Estimate | None
    between_chips: Estimate | None
    cores: tuple[CoreTime, ...]
    missing: tuple[str, ...]
    not_modelled: tuple[str, ...] = NOT_MODELLED

    @property
    def against_dt(self) -> str:
        """The longest step against dt: within it only where the upper bound is within it."""
        fits = "within" if self.fits_at_high else "not shown to be within"
        return f"{fits if self.fits else 'longer than'} dt = {1000 * self.dt_s:g} ms"

    def to_dict(self) -> dict[str, object]:
        """Return plain data, ready for JSON."""
        return plain(self)


def timing(activity: Activity, chip: ChipModel, calibration: EnergyCalibration) -> TimingReport:
    """Return the mean and longest step of a run; for the equations see `step_time`.

    Links between tiles and the host's input and output are not modelled.

    Raises
    ------
    UsageError
        The activity has no steps or no cores, or its folded steps are for another chip or lack
        times of this calibration.
    CompileError
        More cores are in use than the chip's mesh has.
    """
    times = time_sums(activity, chip, calibration)
    wait = barrier(tiles_used(len(activity.cores), chip), calibration)
    links = between_chips(activity, chip, calibration)
    source = _source(activity, calibration, (wait, links))
    worst = _estimate(times.worst_s, source)
    return TimingReport(
        calibration=calibration.name,
        n_steps=activity.n_steps,
        dt_s=activity.dt_s,
        mean=_estimate(times.total_s / activity.n_steps, source),
        worst=worst,
        worst_step=times.worst_step,
        limiting_core=SHARED.get(times.limiting_core) or activity.cores[times.limiting_core],
        fits=worst.value <= activity.dt_s,
        fits_at_high=None if worst.high is None else worst.high <= activity.dt_s,
        barrier=wait,
        between_chips=links,
        cores=tuple(
            CoreTime(label, mean_core_time(activity, calibration, core))
            for core, label in enumerate(activity.cores)
        ),
        missing=_missing(activity, calibration, links),
    )


def _estimate(bounds: np.ndarray, source: str) -> Estimate:
    value, low, high = bounds.tolist()
    return Estimate(value, known(low), known(high), "s", source)


def _source(
    activity: Activity, calibration: EnergyCalibration, others: Iterable[Estimate | None]
) -> str:
    figures = [getattr(calibration.times, event.name) for event in core_events(activity)]
    figures.append(calibration.times.message_on_bus)
    estimates = [figure.estimate for figure in figures if figure is not None]
    return merge_sources(e.source for e in [*estimates, *others] if e is not None)


def _missing(
    activity: Activity, calibration: EnergyCalibration, links: Estimate | None
) -> tuple[str, ...]:
    names = [event.name for event in core_events(activity)]
    missing = [name for name in names if getattr(calibration.times, name) is None]
    missing += ["message_between_chips"] if links is None else []
    return tuple(missing + ([] if calibration.barrier else ["barrier"]))
