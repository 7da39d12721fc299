"""``spikeport evaluate``: a robustness table of a policy."""

from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING

from spikeport.atomic import write_text
from spikeport.commands.checks import (
    check_needed,
    check_target,
    check_whole_steps,
    refuse_compile_options,
    seconds_of,
    seeds_from,
)
from spikeport.commands.console import ScreenTable, line_console
from spikeport.commands.options_of_experiments import EvaluateRequest
from spikeport.commands.points import check_workers, print_failures, run_points
from spikeport.commands.screen import print_written
from spikeport.constants import MOST_POINTS
from spikeport.counted import counted
from spikeport.errors import UsageError, unknown
from spikeport.experiments import registry
from spikeport.experiments.evaluate.comparison import KIND
from spikeport.experiments.options import WITHOUT_NEURONS
from spikeport.experiments.run_folder import write_figure, write_result
from spikeport.experiments.sweep.folder import SweepFolder, opened
from spikeport.experiments.sweep.inputs import with_inputs
from spikeport.key_values import SettingValue
from spikeport.plots import rendered

if TYPE_CHECKING:
    from spikeport.experiments.evaluate.plan import EvaluationSweep
    from spikeport.experiments.evaluate.table import TableRow

EXPERIMENT = "walk"
EPISODE_S = 20.0
SHOWN = ("speed_error_m_s", "yaw_rate_error_rad_s", "speed_use", "impact_bw")
"""Figures on the screen, as many as fit into 80 columns; the files in the folder have all."""


def run(request: EvaluateRequest) -> int:
    """Run the missing episodes of an evaluation, and write its table; return 1 if any failed."""
    if request.experiment != EXPERIMENT:
        raise unknown("experiment to evaluate", request.experiment, (EXPERIMENT,))
    episode = registry.imported("an evaluation", "spikeport.experiments.evaluate.episode")
    evaluation, run_episode = planned(request), episode.EpisodeRun.new()
    check_workers(request.workers)
    with opened(request.out, evaluation) as folder:
        failures = run_points(evaluation, run_episode, folder, request.workers, "episodes")
        try:
            _write(evaluation, folder)
        finally:  # also if the table is refused, for an episode's file
            print_failures(failures)
    return int(bool(failures))


def planned(request: EvaluateRequest) -> "EvaluationSweep":
    """Return the evaluation, with every setting checked, and digests of its files.

    Raises
    ------
    UsageError
        If a setting, row or backend is not one of the experiment's, or a file cannot be read.
    """
    from spikeport.experiments.evaluate.measures import SHORTEST_S
    from spikeport.experiments.evaluate.plan import EvaluationSweep
    from spikeport.experiments.evaluate.rows import find_rows
    from spikeport.robot.times import PHYSICS_DT_S

    experiment, target = registry.get(EXPERIMENT), request.target
    experiment.check_backend_of_many(target.backend, "an evaluation")
    check_target(target)
    if target.backend == WITHOUT_NEURONS:
        refuse_compile_options(target)
    settings = experiment.parse_settings(request.settings)
    _refuse_others(settings)
    seconds = EPISODE_S if request.seconds is None else seconds_of(request.seconds, experiment)
    # To the nearest step, which would be the cure for a time that is no whole number of them.
    if round(seconds / PHYSICS_DT_S) * PHYSICS_DT_S <= SHORTEST_S:
        raise UsageError(
            f"--seconds {seconds:g}: the measures need episodes longer than {SHORTEST_S:g} s; "
            f"cure: leave it out, for the default of {EPISODE_S:g} s"
        )
    # An exact policy has no steps between those of the robot.
    check_whole_steps("--seconds", seconds, PHYSICS_DT_S)
    evaluation = EvaluationSweep(
        experiment=experiment.name,
        backend=target.backend,
        chip=target.chip,
        pipeline=experiment.passes(target.passes),
        seconds=seconds,
        # One network for all episodes: it is made once, and seeds change only the conditions.
        settings={"network_seed": 0, **settings},
        varied={},
        seeds=seeds_from(request.seed, request.episodes, "episodes"),
        rows=find_rows(request.rows),
    )
    _check(evaluation)
    return with_inputs(evaluation)


def _refuse_others(settings: Mapping[str, SettingValue]) -> None:
    """Refuse settings of the experiment that are not the policy's."""
    from spikeport.experiments.policy.settings import PolicySettings
    from spikeport.robot.perturbation import Perturbation

    perturbations = {field.name for field in fields(Perturbation)}
    known = {field.name for field in fields(PolicySettings)} - {"appearance"}
    for key, value in settings.items():
        if key in perturbations:
            raise UsageError(
                f"--set {key}: it would perturb the nominal row too; cure: --row {key}={value}"
            )
        if key not in known:
            raise UsageError(
                f"--set {key}: an evaluation draws commands, follows no path, silences no neurons "
                "and shows no robot; cure: leave it out"
            )


def _check(evaluation: "EvaluationSweep") -> None:
    from spikeport.experiments.walk.gait import SEED

    n_points = len(evaluation.rows) * len(evaluation.seeds)
    if n_points > MOST_POINTS:
        raise UsageError(
            f"an evaluation of {n_points:,} episodes, limit {MOST_POINTS:,}; cure: fewer --row or "
            "--episodes"
        )
    if SEED in evaluation.seeds:
        raise UsageError(
            f"--seed {evaluation.seeds[0]}: {len(evaluation.seeds):,} episodes include seed "
            f"{SEED}, that of the gait which neurons are made for; cure: --seed {SEED + 1}"
        )
    experiment, seed = registry.get(EXPERIMENT), evaluation.seeds[0]
    # A row's settings are the same in all of its episodes, so one episode per row is enough.
    points = [evaluation.point(row, seed) for row in evaluation.rows]
    trials = [experiment.trial(experiment.settings(**one.settings), one.options) for one in points]
    check_needed(evaluation.settings, trials)
    for trial in trials:
        trial.check()


def _write(evaluation: "EvaluationSweep", folder: SweepFolder) -> None:
    """Write table and picture of the finished episodes, and print the table."""
    from spikeport.experiments.evaluate.figure import figure
    from spikeport.experiments.evaluate.table import as_json, markdown, table

    rows = table(evaluation, folder)
    if not rows:
        return
    title = _title(evaluation)
    write_text(folder.path / "table.md", markdown(rows))
    plan = asdict(evaluation)
    del plan["varied"], plan["probes"], plan["spikeport"], plan["versions"]
    result = {**plan, "experiment": f"{KIND}{evaluation.experiment}", "rows": as_json(rows)}
    write_result(folder.path, result)
    write_figure(folder.path, rendered(figure(rows, f"{title}, intervals of 95 %")))
    _show(rows, title, folder.path)


def _title(evaluation: "EvaluationSweep") -> str:
    """Return the title of the table: the policy, the backend, and number and length of episodes."""
    from spikeport.experiments.policy.settings import EXACT, SPIKING

    policy, n = evaluation.settings.get("policy", SPIKING), len(evaluation.seeds)
    file = "" if policy in (SPIKING, EXACT) else f" of {policy}"
    # The analytic backend has no neurons, whatever the policy.
    if evaluation.backend == WITHOUT_NEURONS or policy == EXACT:
        whose = f"the exact policy{file}"
    else:
        whose = f"the spiking policy{file} on {evaluation.backend}"
    return f"{whose}, {counted(n, 'episode')} of {evaluation.seconds:g} s a row"


def _show(rows: "list[TableRow]", title: str, folder: Path) -> None:
    console = line_console()
    console.print(title)
    console.print(screen_table(rows))
    console.print("intervals of 95 %, and all figures: table.md")
    print_written(console, folder)


def screen_table(rows: "list[TableRow]") -> ScreenTable:
    """Return the table of falls and of the means in `SHOWN`, for a screen of 80 columns."""
    from spikeport.experiments.evaluate.measures import MEASURES

    shown = ScreenTable("perturbation", "falls")
    # A word per line: headings are wider than their numbers.
    shown.add_numbers(*(MEASURES[name].heading.replace(" ", "\n") for name in SHOWN))
    for one in rows:
        means = (one.means[name] for name in SHOWN)
        cells = ("-" if mean is None else f"{mean.estimate:.3f}" for mean in means)
        shown.add_row(one.name, one.fallen, *cells)
    return shown
