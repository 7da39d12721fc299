"""The energy of a run: dynamic, static and system, always all three, from exact counts."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spikeport.hardware_models import events
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.calibration import EnergyCalibration
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.estimate import Estimate, at_least_zero, plain, zero
from spikeport.hardware_models.step_time import time_sums

EVENTS: tuple[events.Event, ...] = (
    events.SYNAPTIC_OPERATION,
    events.UPDATE_ACTIVE,
    events.UPDATE_INACTIVE,
    events.SPIKE,
    events.Messages(),
    events.HOPS_EAST_WEST,
    events.HOPS_NORTH_SOUTH,
    events.MessagesBetweenChips(),
    events.LEARNING_UPDATE,
)
NOT_MODELLED = (
    "hops of messages from the host, whose route is not public",
    "work of the host's and the chip's processors",
)


@dataclass(frozen=True)
class EnergyTerm:
    """One term of the dynamic energy: count * figure, in J; None: no public figure."""

    event: str
    count: int | float
    energy: Estimate | None


@dataclass(frozen=True)
class Draw:
    """Mean energy of a step, in J, and mean power, in W."""

    energy_step: Estimate
    power: Estimate


@dataclass(frozen=True)
class CoreEnergy:
    """Mean dynamic energy of a step on one core, in J; None: no public figure.

    A core's share includes the messages it sends, and the messages it receives from the host.
    """

    core: str
    energy_step: Estimate | None


@dataclass(frozen=True)
class ModuleEnergy:
    """Mean energy of a step of one module, in J; None: no public figure.

    The energy is that of the module's neurons and synapses, on any core. Messages depend on the
    placement, and are not included.
    """

    module: str
    energy_step: Estimate | None


@dataclass(frozen=True)
class EnergyReport:
    """The energy and power of a run.

    Parameters
    ----------
    calibration : str
        The name of the calibration with these energies and times.
    n_steps, period_s : int, float
        Number of steps of the run, and the mean time from one to the next in real time, in s.
    terms : tuple of EnergyTerm
        The dynamic energy of the run, event by event.
    dynamic_run : Estimate or None
        The sum of the terms, in J; None: no event that happened has a public figure.
    dynamic, static : Draw or None
        The draw of the events, and of the chips at rest; None: no public figure.
    system : Draw or None
        The draw of the whole board: at rest, chips included, and the events on top.
    cores : tuple of CoreEnergy
        The dynamic energy of a step, core by core.
    missing : tuple of str
        Events that happened, and powers, without a public figure, or without one for so many
        chips; their energy is left out.
    not_modelled : tuple of str
        Items that cost energy and are not in this model, and so are left out as well.
    """

    calibration: str
    n_steps: int
    period_s: float
    terms: tuple[EnergyTerm, ...]
    dynamic_run: Estimate | None
    dynamic: Draw | None
    static: Draw | None
    system: Draw | None
    cores: tuple[CoreEnergy, ...]
    missing: tuple[str, ...]
    not_modelled: tuple[str, ...] = NOT_MODELLED

    def to_dict(self) -> dict[str, object]:
        """Return plain data, ready for JSON."""
        return plain(self)


def energy(activity: Activity, chip: ChipModel, calibration: EnergyCalibration) -> EnergyReport:
    """Return the energy and power of a run in real time.

        E_dyn  = N_syn e_syn + N_act e_act + N_inact e_inact + N_spk e_spk + N_msg e_msg
                 + H_ew e_ew + H_ns e_ns + N_between e_between + N_learn e_learn
        E_stat = T n_chips P_chip,   T = mean over steps of max(T_step, dt)
        P_sys  = P_board_idle + E_dyn / T

    N_between are the messages between chips. E_dyn is the mean of a step here. T is taken at the
    calibration's times, not at their bounds; every chip of the board draws static power.

    Raises
    ------
    UsageError
        The activity has no steps or no cores, or its folded steps are for another chip or lack
        times of this calibration.
    CompileError
        More cores are in use than the chip's mesh has.
    """
    period_s = time_sums(activity, chip, calibration).period_s / activity.n_steps
    counts = {event.name: event.per_core(activity, chip) for event in EVENTS}
    terms = _terms({name: count.sum() for name, count in counts.items()}, calibration)
    run = _sum(terms)
    dynamic = None if run is None else _draw(run.scaled(1 / activity.n_steps), period_s)
    static, system = _static(chip, period_s), _system(chip, dynamic, period_s)
    return EnergyReport(
        calibration=calibration.name,
        n_steps=activity.n_steps,
        period_s=period_s,
        terms=terms,
        dynamic_run=run,
        dynamic=dynamic,
        static=static,
        system=system,
        cores=tuple(
            CoreEnergy(label, _per_step(count, activity, calibration))
            for label, count in zip(activity.cores, _of_each(counts), strict=True)
        ),
        missing=(*_missing(terms, static, system), *_hops(activity, chip)),
    )


def module_energies(
    activity: Activity, names: Sequence[str], chip: ChipModel, calibration: EnergyCalibration
) -> list[ModuleEnergy]:
    """Return the energy of modules, from an image's activity in which each has its own core."""
    # Messages and hops depend on the cores that modules share, so they have no module.
    on_core = [event for event in EVENTS if isinstance(event, events.OnCore)]
    counts = {event.name: event.per_core(activity, chip) for event in on_core}
    return [
        ModuleEnergy(name, _per_step(count, activity, calibration))
        for name, count in zip(names, _of_each(counts), strict=True)
    ]


def _terms(counts: dict[str, np.generic], calibration: EnergyCalibration) -> tuple[EnergyTerm, ...]:
    figures = {name: getattr(calibration.energies, name) for name in counts}
    return tuple(
        EnergyTerm(
            name, count.item(), figures[name] and figures[name].estimate.scaled(count.item())
        )
        for name, count in counts.items()
    )


def _sum(terms: tuple[EnergyTerm, ...]) -> Estimate | None:
    happened = [term.energy for term in terms if term.count]
    # A sum without any figure would read as no energy.
    if happened and not any(happened):
        return None
    return sum((energy or at_least_zero("J") for energy in happened), start=zero("J"))


def _of_each(counts: Mapping[str, np.ndarray]) -> list[dict[str, np.generic]]:
    """Return the counts of each core."""
    return [dict(zip(counts, core, strict=True)) for core in zip(*counts.values(), strict=True)]


def _per_step(
    counts: dict[str, np.generic], activity: Activity, calibration: EnergyCalibration
) -> Estimate | None:
    run = _sum(_terms(counts, calibration))
    return None if run is None else run.scaled(1 / activity.n_steps)


def _draw(energy_step: Estimate, period_s: float) -> Draw:
    return Draw(energy_step, energy_step.scaled(1 / period_s, unit="W"))


def static_power(chip: ChipModel) -> Estimate | None:
    """Return the power of all chips of a board at rest, in W; None without a public figure."""
    figure = chip.power.static_chip_w
    # A chip at rest draws it too, so that a board's unused chips count.
    return None if figure is None else figure.estimate.scaled(chip.limits.chips.count)


def _static(chip: ChipModel, period_s: float) -> Draw | None:
    power = static_power(chip)
    return None if power is None else Draw(power.scaled(period_s, unit="J"), power)


def _system(chip: ChipModel, dynamic: Draw | None, period_s: float) -> Draw | None:
    figure, chips = chip.power.board_idle_w, static_power(chip)
    if figure is None:
        return None
    # A board's idle power includes that of its chips: the figure is that of a smaller board.
    if chips is not None and chips.value > figure.estimate.value:
        return None
    power = figure.estimate + (at_least_zero("W") if dynamic is None else dynamic.power)
    return Draw(power.scaled(period_s, unit="J"), power)


def _hops(activity: Activity, chip: ChipModel) -> Iterator[str]:
    """Yield the hops of messages between cores if they cannot be counted without a public mesh."""
    between = activity.messages[~np.eye(len(activity.messages), dtype=bool)]
    if chip.topology is None and chip.soft_memory is None and between.any():
        yield "hops"


def _missing(
    terms: tuple[EnergyTerm, ...], static: Draw | None, system: Draw | None
) -> tuple[str, ...]:
    names = [term.event for term in terms if term.count and term.energy is None]
    powers = {"static_chip_w": static, "board_idle_w": system}
    return tuple(names + [name for name, draw in powers.items() if draw is None])
