"""The commands on experiments of the paper, and on policies that walk the robot."""

from typing import Annotated

import typer

from spikeport.commands.option_groups import with_options
from spikeport.commands.options import RunOptions, Target, Workers
from spikeport.commands.options_of_experiments import (
    CalibrateRequest,
    EvaluateRequest,
    ExperimentName,
    SweepRequest,
    TrainRequest,
)
from spikeport.commands.options_of_links import Link, RobotLink, Tls

experiments_app = typer.Typer()


@experiments_app.command("run")
@with_options
def run_command(
    experiment: ExperimentName,
    target: Target,
    options: RunOptions,
    link: Link,
    tls: Tls,
    robot_link: RobotLink,
) -> None:
    """Run an experiment of the paper in closed loop with the robot."""
    from spikeport.commands.links import link_options, robot_options
    from spikeport.commands.run import RunRequest, run

    run(
        RunRequest(
            experiment=experiment,
            target=target,
            options=options,
            link=link_options(link, tls, target.backend),
            robot=robot_options(robot_link),
        )
    )


@experiments_app.command("calibrate")
@with_options
def calibrate_command(request: CalibrateRequest) -> None:
    """Calibrate an experiment: refit its decoders to its neurons on a backend."""
    from spikeport.commands.calibrate import run

    run(request)


@experiments_app.command("train")
@with_options
def train_command(request: TrainRequest) -> None:
    """Train a policy from scratch, or resume an interrupted run."""
    from spikeport.commands.train import run

    run(request)


@experiments_app.command("figure")
@with_options
def figure_command(
    figure: Annotated[
        str,
        typer.Argument(
            help="The paper's number, or a name: 1 teaser, 2 overview, 3 reach, 4 draw, 5a walk, "
            "5b walk-sweep, 5c walk-silenced, 6 basal-ganglia."
        ),
    ],
    target: Target,
    options: RunOptions,
    workers: Workers,
) -> None:
    """Make a figure of the paper by its run, or by its sweep for 5a and 5b.

    Figure 2 is drawn from the network, without a run. Options of another kind are refused.
    """
    from spikeport.commands.figure import FigureRequest, make

    request = FigureRequest(figure=figure, target=target, options=options, workers=workers)
    raise typer.Exit(make(request))


@experiments_app.command("sweep")
@with_options
def sweep_command(request: SweepRequest) -> None:
    """Run an experiment with many settings and seeds, or resume such a sweep."""
    from spikeport.commands.sweep import run

    raise typer.Exit(run(request))


@experiments_app.command("evaluate")
@with_options
def evaluate_command(request: EvaluateRequest) -> None:
    """Evaluate the robustness of a policy: falls, tracking, margins, gait."""
    from spikeport.commands.evaluate import run

    raise typer.Exit(run(request))
