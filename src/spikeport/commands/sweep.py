"""``spikeport sweep``: an experiment at many settings, from several seeds."""

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from spikeport.commands.checks import (
    check_needed,
    check_target,
    refuse_compile_options,
    seconds_of,
    seeds_from,
)
from spikeport.commands.console import line_console
from spikeport.commands.options import Target
from spikeport.commands.options_of_experiments import SweepRequest
from spikeport.commands.points import check_workers, print_failures, run_points
from spikeport.commands.screen import print_written
from spikeport.constants import MOST_POINTS
from spikeport.errors import UsageError
from spikeport.experiments import registry
from spikeport.experiments.options import WITHOUT_NEURONS, Experiment
from spikeport.experiments.run_folder import write_figure
from spikeport.experiments.sweep.folder import opened
from spikeport.experiments.sweep.inputs import with_inputs
from spikeport.experiments.sweep.plan import BACKEND, Sweep
from spikeport.key_values import SettingValue
from spikeport.plots import rendered

POINT, TABLE = "spikeport.experiments.sweep.point", "spikeport.experiments.sweep.table"
"""The modules that need the extra `robot`; they are imported only for a sweep."""


def run(request: SweepRequest) -> int:
    """Run the missing points of a sweep, and draw it; return 1 if a point failed, else 0."""
    sweep = planned(request)
    point, tables, drawing = (
        registry.imported("a sweep", module) for module in (POINT, TABLE, request.figure)
    )
    check_workers(request.workers)
    with opened(request.out, sweep) as folder:
        failures = run_points(sweep, point.PointRun.new(), folder, request.workers, "points")
        try:
            if any(map(folder.holds, sweep.points())):
                table = tables.table(sweep, folder)
                tables.write_table(folder, table)
                write_figure(folder.path, rendered(drawing.figure(sweep, folder, table)))
        finally:  # also if the table is refused, for a point's file
            print_failures(failures)
    _show(folder.path, len(sweep.points()), len(failures))
    return int(bool(failures))


def planned(request: SweepRequest) -> Sweep:
    """Return the sweep, with every value of every point checked, and digests of its files.

    Raises
    ------
    UsageError
        If a setting or value is not one of the experiment's, or a file cannot be read.
    """
    experiment, target = registry.get(request.experiment), request.target
    check_target(target)
    sweep = Sweep(
        experiment=experiment.name,
        backend=target.backend,
        chip=target.chip,
        pipeline=experiment.passes(target.passes),
        seconds=seconds_of(request.seconds, experiment),
        settings=experiment.parse_settings(request.settings),
        varied=_varied(request.vary, experiment),
        seeds=seeds_from(request.first_seed, request.n_seeds, "runs"),
        probes=request.probes,
    )
    _check(sweep, experiment)
    if set(_backends(sweep)) == {WITHOUT_NEURONS}:
        refuse_compile_options(replace(target, backend=WITHOUT_NEURONS))
    return with_inputs(sweep)


def _varied(vary: Iterable[str], experiment: Experiment) -> dict[str, tuple[SettingValue, ...]]:
    varied: dict[str, tuple[SettingValue, ...]] = {}
    for pair in vary:
        key, equals, texts = pair.partition("=")
        if not equals:
            raise UsageError(f"--vary {pair}: expected KEY=VALUE,VALUE,...")
        if key in varied:
            raise UsageError(f"--vary {key}: given twice")
        values = tuple(_value(key, text, experiment) for text in _split(texts))
        if len(set(values)) < len(values):
            raise UsageError(f"--vary {pair}: a value is given twice")
        varied[key] = values
    return varied


def _split(texts: str) -> list[str]:
    """Return the texts of values, which commas separate, or semicolons if there is one."""
    return texts.removesuffix(";").split(";") if ";" in texts else texts.split(",")


def _value(key: str, text: str, experiment: Experiment) -> SettingValue:
    # The backend varies like a setting, but is not one.
    if key == BACKEND:
        return text
    return experiment.parse_settings([f"{key}={text}"], option="--vary")[key]


def _backends(sweep: Sweep) -> Iterable[Any]:
    return sweep.varied.get(BACKEND, (sweep.backend,))


def _check(sweep: Sweep, experiment: Experiment) -> None:
    for key in sweep.varied:
        if key in sweep.settings:
            raise UsageError(f"--vary {key}: also given with --set; choose one")
    for backend in _backends(sweep):
        experiment.check_backend_of_many(backend, "a sweep")
    if BACKEND in sweep.varied and sweep.backend != Target.backend:
        raise UsageError(f"--vary {BACKEND}: also given with --{BACKEND}; choose one")
    # Counted before points are made: there may be too many to hold.
    n_points = math.prod(map(len, sweep.axes.values()))
    if n_points > MOST_POINTS:
        raise UsageError(
            f"a sweep of {n_points:,} points, limit {MOST_POINTS:,}; cure: fewer values of --vary, "
            "or fewer --seeds"
        )
    trials = [
        experiment.trial(experiment.settings(**point.settings), point.options)
        for point in sweep.of_a_seed()
    ]
    check_needed([*sweep.settings, *sweep.varied], trials)
    for trial in trials:
        trial.check()


def _show(folder: Path, n_points: int, n_failed: int) -> None:
    console = line_console()
    console.print(f"{n_points - n_failed} of {n_points} points finished")
    print_written(console, folder)
