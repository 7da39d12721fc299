"""Tables of the resources and energy of every core, and the energy of every module."""

from spikeport.commands.console import Table
from spikeport.commands.tables import NO_FIGURE
from spikeport.compile.report.report import Modules, Report
from spikeport.counted import in_kib
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import energy


def core_table(report: Report, activity: Activity | None) -> Table:
    """Return the table of cores: their content, and the energy of a step on each."""
    table = Table(title="cores")
    table.add_column("core", justify="right")
    table.add_column("holds")
    for name in ("neurons", "axons in", "out", "KiB"):
        table.add_column(name, justify="right")
    costs = {} if activity is None else _core_costs(report.chip, activity)
    for name in costs:
        table.add_column(f"energy / step, {name}", justify="right")
    for number, core in enumerate(report.cores):
        numbers = (core.compartments, core.in_axons, core.out_axons)
        spent = [texts[number] for texts in costs.values()]
        sizes = *(f"{n:,.0f}" for n in numbers), in_kib(core.synapse_bits)
        table.add_row(str(number), core.label, *sizes, *spent)
    return table


def _core_costs(chip: ChipModel, activity: Activity) -> dict[str, list[str]]:
    """Return the energy of a step on each core, in words, by calibration."""
    return {
        c.name: [
            core.energy_step.format() if core.energy_step else NO_FIGURE
            for core in energy(activity, chip, c).cores
        ]
        for c in chip.calibrations
    }


def module_table(chip: ChipModel, modules: Modules) -> Table:
    """Return the table of the energy of a step of every module, without messages."""
    table = Table("module", title="modules, without messages")
    spent = modules.energies(chip)
    for name in spent:
        table.add_column(f"energy / step, {name}", justify="right")
    for name, *found in zip(modules.names, *spent.values(), strict=True):
        texts = [one.energy_step.format() if one.energy_step else NO_FIGURE for one in found]
        table.add_row(name, *texts)
    return table
