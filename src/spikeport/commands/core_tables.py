"""Tables of the resources and energy of every core, and the energy of every module."""

from spikeport.commands.console import ScreenTable
from spikeport.commands.tables import NO_FIGURE
from spikeport.compile.report.report import Modules, Report
from spikeport.counted import in_kib
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import energy
from spikeport.hardware_models.estimate import Estimate


def core_table(report: Report, activity: Activity | None) -> ScreenTable:
    """Return the table of cores: their content, and the energy of a step on each."""
    table = ScreenTable(title="cores")
    table.add_numbers("core")
    table.add_column("holds")
    table.add_numbers("neurons", "axons in", "out", "KiB")
    costs = {} if activity is None else _core_costs(report.chip, activity)
    table.add_numbers(*(f"energy / step, {name}" for name in costs))
    for number, core in enumerate(report.cores):
        numbers = (core.compartments, core.in_axons, core.out_axons)
        spent = [texts[number] for texts in costs.values()]
        sizes = *(f"{n:,.0f}" for n in numbers), in_kib(core.synapse_bits)
        table.add_row(str(number), core.label, *sizes, *spent)
    return table


def _core_costs(chip: ChipModel, activity: Activity) -> dict[str, list[str]]:
    """Return the energy of a step on each core, in words, by calibration."""
    return {
        c.name: [_text(core.energy_step) for core in energy(activity, chip, c).cores]
        for c in chip.calibrations
    }


def module_table(chip: ChipModel, modules: Modules) -> ScreenTable:
    """Return the table of the energy of a step of every module, without messages."""
    table = ScreenTable("module", title="modules, without messages")
    spent = modules.energies(chip)
    table.add_numbers(*(f"energy / step, {name}" for name in spent))
    for name, *found in zip(modules.names, *spent.values(), strict=True):
        table.add_row(name, *(_text(one.energy_step) for one in found))
    return table


def _text(energy_step: Estimate | None) -> str:
    return energy_step.format() if energy_step else NO_FIGURE
