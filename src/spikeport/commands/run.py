"""``spikeport run``."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from spikeport import cache
from spikeport.backends.board.link import OWN_STUB, LinkOptions
from spikeport.commands.checks import (
    check_counts,
    check_needed,
    check_target,
    refuse_compile_options,
    seconds_of,
)
from spikeport.commands.console import Console, ScreenTable
from spikeport.commands.ending import ended_in_order
from spikeport.commands.options import RunOptions, Target
from spikeport.commands.progress import progress_bar
from spikeport.commands.screen import print_costs, print_written
from spikeport.commands.tables import resource_table
from spikeport.compile.report.drawing import estimate
from spikeport.experiments import registry, run_folder
from spikeport.experiments.link_lines import link_line, robot_line
from spikeport.experiments.options import WITHOUT_NEURONS, Options, Outcome, keeps_to_a_clock

if TYPE_CHECKING:
    from spikeport.robot.link.connection import RobotOptions


@dataclass(frozen=True, kw_only=True)
class RunRequest:
    """A run of an experiment, as the user asked for it."""

    experiment: str
    target: Target
    options: RunOptions
    link: LinkOptions = OWN_STUB
    robot: "RobotOptions | None" = None


def run(request: RunRequest) -> None:
    """Check the request, run the experiment, print its figures."""
    experiment, target, asked = registry.get(request.experiment), request.target, request.options
    experiment.check_backend(target.backend)
    given = experiment.parse_settings(asked.settings)
    chosen = experiment.settings(**given)
    seconds = seconds_of(asked.seconds, experiment)
    check_needed(given, [experiment.trial(chosen, Options(seconds, target.backend))])
    check_target(target)
    check_counts(asked.counts, target)
    if target.backend == WITHOUT_NEURONS:
        refuse_compile_options(target)
    with (
        ended_in_order(),
        run_folder.opened(asked.out, experiment.name, asked.overwrite) as folder,
        run_folder.counting(asked.counts) as counts,
        # drawing a bar ten times a second delays steps that keep to the clock
        progress_bar(moves=not keeps_to_a_clock(request.link, request.robot)) as progress,
    ):
        run_folder.check_outside(folder, "--record", request.link.record)
        options = Options(
            seconds=seconds,
            backend=target.backend,
            chip=target.chip,
            pipeline=experiment.passes(target.passes),
            seed=asked.seed,
            video=asked.video,
            link=request.link,
            cache=cache.of_user(),
            robot=request.robot,
            counts=counts,
            progress=progress,
            command=("spikeport", *sys.argv[1:]),
        )
        outcome = experiment.run(chosen, options, folder)
    show_outcome(outcome, folder)


def show_outcome(outcome: Outcome, folder: Path) -> None:
    """Print the outcome of a run."""
    console = Console()
    result = outcome.result
    if outcome.report is not None:
        console.print(resource_table(outcome.report))
        print_costs(console, outcome.report, outcome.activity)
    if result["energy_by_unit"]:
        console.print(unit_table(result["energy_by_unit"]))
    table = ScreenTable("metric", "value", title=f"{result['experiment']} on {result['backend']}")
    for name, value in result["metrics"].items():
        table.add_row(name, _text(value))
    console.print(table)
    for line in _link_lines(result):
        console.print(line, highlight=False, soft_wrap=True)
    print_written(console, folder)


def _link_lines(result: Mapping[str, Any]) -> list[str]:
    """Return a line on each of a run's links."""
    lines = [link_line(result["link"])] if result["link"] is not None else []
    return lines + ([robot_line(result["robot"])] if result["robot"] is not None else [])


def unit_table(found: Mapping[str, Mapping[str, Any]]) -> ScreenTable:
    """Return the table of the energy per unit of a robot's work, in every calibration."""
    table = ScreenTable("energy", caption="without host processors and host I/O")
    for name in next(iter(found.values())):
        table.add_column(name)
    for unit, by_calibration in found.items():
        for kind in ("dynamic", "static"):
            texts = [estimate(spent[kind]) for spent in by_calibration.values()]
            table.add_row(f"{kind}, a {unit}", *texts)
    return table


def _text(value: object) -> str:
    if value in (None, {}, []):
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        called = f"{value['name']}: " if "name" in value else ""
        return called + ", ".join(f"{k} {_text(v)}" for k, v in value.items() if k != "name")
    if isinstance(value, list):
        rows = any(isinstance(v, dict) for v in value)
        return ("\n" if rows else "  ").join(_text(v) for v in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)
