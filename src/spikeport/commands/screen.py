"""The report on a compile, on one screen, and the last line of commands that write a folder."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from spikeport.commands.console import Console
from spikeport.commands.core_tables import core_table, module_table
from spikeport.commands.passes import pass_lines
from spikeport.commands.tables import (
    cost_notes,
    cost_table,
    host_io_table,
    loss_table,
    resource_table,
)
from spikeport.compile.check.lost_values import hints_after
from spikeport.compile.check.violation import Violation, hint_lines, on_host_lines
from spikeport.compile.image.expected import Rates
from spikeport.compile.report.loss import Loss
from spikeport.compile.report.neurobench import NeuroBench, workload
from spikeport.compile.report.report import Json, Modules, Report
from spikeport.compile.report.summary import verdict
from spikeport.hardware_models.activity import Activity


@dataclass(frozen=True)
class Findings:
    """The findings on a compile.

    ``activity`` holds the counts of a run, or the counts expected at ``rates``; ``modules`` holds
    the same counts by module.
    """

    report: Report
    activity: Activity | None = None
    rates: Rates | None = None
    loss: Loss | None = None
    modules: Modules | None = None

    @property
    def hints(self) -> tuple[Violation, ...]:
        """The hints of the compile, of its run, and of a loss that was measured."""
        if self.activity is None:
            return self.report.hints
        of_loss = () if self.loss is None else self.loss.hints
        found = hints_after(self.activity, self.report.hints)
        return tuple(dict.fromkeys((*found, *of_loss)))

    def to_dict(self) -> Json:
        """Return plain data, ready for JSON."""
        report, loss = self.report, None
        if self.loss is not None:
            report = replace(report, hints=self.hints)
            loss = self.loss.to_dict()
        return report.to_dict(self.activity, self.rates, loss, self.modules)


def show_findings(findings: Findings, cores: bool) -> None:
    """Print the report; if ``cores``, with the tables of all cores and modules."""
    console = Console(highlight=False)
    report = findings.report
    console.print(resource_table(report))
    if cores:
        console.print(core_table(report, findings.activity))
        if findings.modules is not None:
            console.print(module_table(report.chip, findings.modules))
    print_costs(console, report, findings.activity, findings.rates)
    if report.neurobench is not None:
        console.print(neurobench_line(report.neurobench, findings.activity))
    if findings.loss is not None:
        console.print(loss_table(findings.loss))
    for line in pass_lines(report):
        console.print(line, style="dim")
    print_on_host(console, report)
    print_hints(console, report, findings.hints)
    console.print(verdict(report))


def print_costs(
    console: Console, report: Report, activity: Activity | None, rates: Rates | None = None
) -> None:
    """Print energy and time, if there is an activity, and the host's input and output."""
    host_io = report.host_io(activity, rates)
    if activity is not None and report.chip.calibrations:
        console.print(cost_table(report.chip, activity, rates, host_io))
        for note in cost_notes(report.chip, activity, rates):
            console.print(note, style="dim")
    if host_io is not None:
        console.print(host_io_table(host_io))


def show_nothing(report: Report, verdict: str) -> None:
    """Print why a network has no image, and the ensembles that were moved to the host."""
    console = Console(highlight=False)
    print_on_host(console, report)
    console.print(f"{verdict}; there is no image")


def print_on_host(console: Console, report: Report) -> None:
    """Print the ensembles on the host: moved ones, with the rule, and others, with the reason."""
    for one in report.offloaded:
        console.print(f"offloaded: {one}")
    for line in on_host_lines(report.on_host):
        console.print(f"on the host: {line}")


def print_hints(console: Console, report: Report, hints: Iterable[Violation]) -> None:
    """Print hints by rule, and the warnings of nengo-loihi."""
    for line in hint_lines(hints):
        console.print(f"hint: {line}")
    for warning in report.warnings:
        console.print(f"nengo-loihi: {warning}", style="dim")


def print_written(console: Console, folder: Path) -> None:
    """Print a folder that was written, and its files, except hidden ones."""
    names = ", ".join(sorted(p.name for p in folder.iterdir() if not p.name.startswith(".")))
    console.print(f"written: {folder}/ ({names})", highlight=False, soft_wrap=True)


def neurobench_line(static: NeuroBench, activity: Activity | None) -> str:
    """Return NeuroBench's metrics on a line."""
    parts = [
        f"footprint {static.footprint_bytes:,} B",
        f"connection sparsity {static.connection_sparsity:.2f}",
        f"synaptic operations a step: dense {static.dense:,.0f}",
    ]
    if activity is not None:
        counts = workload(activity)
        parts.append(f"effective ACs {counts['effective_acs']:,.0f}")
        parts.append(f"effective MACs {counts['effective_macs']:,.0f}")
    return f"NeuroBench: {', '.join(parts)}"
