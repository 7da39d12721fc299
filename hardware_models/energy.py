"""What a run costs: dynamic, static and system, always all three, from exact counts."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from spikeport.hardware_models import events
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.calibration import Calibration
from spikeport.hardware_models.chip import Chip
from spikeport.hardware_models.estimate import Estimate, at_least_zero, zero
from spikeport.hardware_models.step_time import step_times

EVENTS: tuple[events.Event, ...] = (
    events.SYNAPTIC_OPERATION,
    events.UPDATE_ACTIVE,
    events.UPDATE_INACTIVE,
    events.SPIKE,
    events.Messages(),
    events.HopsEastWest(),
    events.HopsNorthSouth(),
    events.LEARNING_UPDATE,
)
NOT_MODELLED = (
    "hops of messages from the host, whose route is not public",
    "work of the host's and the chip's processors",
)


@dataclass(frozen=True)
class Term:
    """One term of the dynamic energy: count * figure, in J; None: no public figure."""

    event: str
    count: int
    energy: Estimate | None


@dataclass(frozen=True)
class Draw:
    """Mean energy of a step, in J, and mean power, in W."""

    energy_step: Estimate
    power: Estimate


@dataclass(frozen=True)
class EnergyReport:
    """What a run costs.

    Parameters
    ----------
    calibration : str
        Whose energies and times these are.
    n_steps, period_s : int, float
        Number of steps of the run, and the mean time from one to the next in real time, in s.
    terms : tuple of Term
        The dynamic energy of the run, event by event.
    dynamic_run : Estimate
        Their sum, in J.
    dynamic, static : Draw, Draw or None
        What the events cost, and what the chips cost at rest; None: no public figure.
    system : Draw or None
        What the whole board costs: at rest, chips included, and the events on top.
    missing : tuple of str
        What has counts or is drawn, and has no public figure; its energy is left out.
    not_modelled : tuple of str
        What costs energy and is not in this model, and so is left out as well.
    """

    calibration: str
    n_steps: int
    period_s: float
    terms: tuple[Term, ...]
    dynamic_run: Estimate
    dynamic: Draw
    static: Draw | None
    system: Draw | None
    missing: tuple[str, ...]
    not_modelled: tuple[str, ...] = NOT_MODELLED

    def to_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return asdict(self) | {
            "terms": [asdict(term) for term in self.terms],
            "missing": list(self.missing),
            "not_modelled": list(self.not_modelled),
        }


def energy(activity: Activity, chip: Chip, calibration: Calibration) -> EnergyReport:
    """Energy and power of a run in real time.

        E_dyn  = N_syn e_syn + N_act e_act + N_inact e_inact + N_spk e_spk + N_msg e_msg
                 + H_ew e_ew + H_ns e_ns + N_learn e_learn
        E_stat = T n_chips P_chip,   T = mean over steps of max(T_step, dt)
        P_sys  = P_board_idle + E_dyn / T

    E_dyn is a step's mean here. T is taken at the calibration's times, not at their bounds; every
    chip of the board draws static power.

    Raises
    ------
    UsageError
        The activity has no steps or no cores.
    CompileError
        More cores are in use than the chip's mesh has.
    """
    step_s = step_times(activity, chip, calibration).value
    period_s = float(np.maximum(step_s, activity.dt_s).mean())
    terms = tuple(_term(event, activity, chip, calibration) for event in EVENTS)
    run = _sum(terms)
    dynamic = _draw(run.scaled(1 / activity.n_steps), period_s)
    return EnergyReport(
        calibration=calibration.name,
        n_steps=activity.n_steps,
        period_s=period_s,
        terms=terms,
        dynamic_run=run,
        dynamic=dynamic,
        static=_static(chip, period_s),
        system=_system(chip, dynamic.power, period_s),
        missing=_missing(terms, chip),
    )


def _term(event: events.Event, activity: Activity, chip: Chip, calibration: Calibration) -> Term:
    count = event.count(activity, chip)
    figure = getattr(calibration.energies, event.name)
    return Term(event.name, count, None if figure is None else figure.estimate.scaled(count))


def _sum(terms: tuple[Term, ...]) -> Estimate:
    happened = [term for term in terms if term.count]
    return sum((term.energy or at_least_zero("J") for term in happened), start=zero("J"))


def _draw(energy_step: Estimate, period_s: float) -> Draw:
    return Draw(energy_step, energy_step.scaled(1 / period_s, unit="W"))


def _static(chip: Chip, period_s: float) -> Draw | None:
    figure = chip.power.static_chip_w
    if figure is None:
        return None
    power = figure.estimate.scaled(chip.limits.chips.count)
    return Draw(power.scaled(period_s, unit="J"), power)


def _system(chip: Chip, dynamic_power: Estimate, period_s: float) -> Draw | None:
    figure = chip.power.board_idle_w
    if figure is None:
        return None
    power = figure.estimate + dynamic_power
    return Draw(power.scaled(period_s, unit="J"), power)


def _missing(terms: tuple[Term, ...], chip: Chip) -> tuple[str, ...]:
    names = [term.event for term in terms if term.count and term.energy is None]
    powers = [name for name in ("static_chip_w", "board_idle_w") if not getattr(chip.power, name)]
    return tuple(names + powers)
