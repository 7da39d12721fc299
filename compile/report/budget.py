"""A budget of the user: the cores, power and step time that a network may take."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.report.report import Report
from spikeport.errors import UsageError
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import EnergyReport, energy, static_power
from spikeport.hardware_models.estimate import Estimate, at_least_zero
from spikeport.hardware_models.timing import timing

OPTIONS = ("--max-cores", "--max-power", "--max-step-us")
RATES_CURE = "set them with --rate-hz, for example --rate-hz 100, or measure them with --loss"


@dataclass(frozen=True)
class Budget:
    """A budget of cores, power and step time; None sets no limit.

    ``power_w`` limits dynamic and static power together, ``step_us`` the longest step, each in the
    costliest calibration of the chip that has figures. At stated rates every step has the mean
    number of spikes, so that steps of a run may be longer.

    Raises
    ------
    UsageError
        A budget is not a positive number.
    """

    cores: int | None = None
    power_w: float | None = None
    step_us: float | None = None

    def __post_init__(self) -> None:
        for option, value in self._limits():
            if not 0 < value < math.inf:
                raise UsageError(f"{option} {value}: a budget is a positive number")

    def _limits(self) -> Iterator[tuple[str, float]]:
        values = (self.cores, self.power_w, self.step_us)
        for option, value in zip(OPTIONS, values, strict=True):
            if value is not None:
                yield option, value

    def check_basis(self, has_activity: bool) -> None:
        """Refuse a budget of power or time if there is no activity to compute them from.

        Raises
        ------
        UsageError
            If there is such a budget, and no activity.
        """
        for option, _ in self._limits():
            if option != "--max-cores" and not has_activity:
                raise UsageError(f"{option} needs firing rates: {RATES_CURE}")

    def exceeded(
        self, report: Report, activity: Activity | None
    ) -> tuple[list[Violation], UsageError | None]:
        """Return every budget that is exceeded, and the error of one that cannot be compared.

        The error is None if the chip has a public figure for each limited quantity.

        Raises
        ------
        UsageError
            If power or time is limited, and there is no activity.
        """
        self.check_basis(activity is not None)
        found, unknown = [*self._cores(report)], None
        if activity is not None:
            for costs in (self._power, self._step):
                try:
                    found += costs(report.chip, activity)
                except UsageError as error:
                    unknown = unknown or error
        return found, unknown

    def _cores(self, report: Report) -> Iterator[Violation]:
        used = len(report.cores)
        if self.cores is not None and used > self.cores:
            yield rules.get("SP301").broken(report.chip.name, f"{used:,}", f"{self.cores:,}")

    def _step(self, chip: ChipModel, activity: Activity) -> Iterator[Violation]:
        if self.step_us is None:
            return
        times = {c.name: timing(activity, chip, c).worst for c in chip.calibrations if c.has_times}
        yield from _held("SP303", chip.name, times, self.step_us / 1e6, f"{self.step_us:g} us")

    def _power(self, chip: ChipModel, activity: Activity) -> Iterator[Violation]:
        if self.power_w is None:
            return
        most, limit, at_rest = self.power_w, f"{self.power_w:g} W", static_power(chip)
        powers = {c.name: _power(energy(activity, chip, c)) for c in chip.calibrations}
        if at_rest is not None and not any(powers.values()) and at_rest.value > most:
            powers = {"at rest": at_rest}  # which exceeds it, whatever the dynamic power is
        held = [*_held("SP302", chip.name, powers, most, limit)]
        if not held and at_rest is None:
            # The dynamic power alone exceeds nothing, but it is not all that the chip draws.
            raise UsageError(
                f"--max-power: chip '{chip.name}' has no public static power, so that its power is "
                "not known to be within a limit; cure: give power.static_chip_w in a chip file of "
                "your own"
            )
        yield from (_at_rest(found, at_rest, most) for found in held)


def _power(spent: EnergyReport) -> Estimate | None:
    """Return dynamic and static power together, as far as they are public."""
    if spent.dynamic is None:
        return None
    static = at_least_zero("W") if spent.static is None else spent.static.power
    return spent.dynamic.power + static


def _at_rest(found: Violation, static: Estimate | None, most: float) -> Violation:
    """Return a violation with another cure if the chip at rest already draws too much."""
    if static is None or static.value < most:
        return found
    cure = rules.get(found.id).in_case["at_rest"]
    return found._replace(cure=cure.format(static=static.format()))


def _held(
    rule_id: str, chip: str, costs: Mapping[str, Estimate | None], most: float, limit: str
) -> Iterator[Violation]:
    """Yield a violation if the largest of the costs, by calibration, exceeds the budget."""
    known = {name: cost for name, cost in costs.items() if cost is not None}
    if not known:
        rule = rules.get(rule_id)
        raise UsageError(f"--{rule.name}: chip '{chip}' has no public figure to compare it with")
    # Calibrations differ: the budget has to hold in each of them.
    name, cost = max(known.items(), key=lambda item: item[1].value)
    if cost.value > most:
        # A budget may be the figure of a report, which is rounded: it must not look like the cost.
        yield rules.get(rule_id).broken(chip, f"{cost.format(6)}, {name}", limit)
