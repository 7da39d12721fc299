"""The options of commands on experiments and their policies, as requests.

This module imports no Nengo: help does not wait for it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from spikeport.commands.options import (
    NoCache,
    SecondsOption,
    SettingsOption,
    Target,
    Workers,
    seed_of,
    written,
)
from spikeport.constants import MOST_POINTS

ExperimentName = Annotated[str, typer.Argument(help="The experiment: draw, reach, switch or walk.")]


@dataclass(frozen=True, kw_only=True)
class CalibrateRequest:
    """A calibration of an experiment's decoders, as the user asked for it."""

    experiment: ExperimentName
    out: Annotated[
        Path, written("Write the calibration to this file, for `run --set calibrated=FILE`.")
    ]
    target: Target
    seconds: SecondsOption = None
    settings: SettingsOption


@dataclass(frozen=True, kw_only=True)
class TrainRequest:
    """A training of a policy, as the user asked for it."""

    policy: Annotated[str, typer.Argument(help="The policy to train: walk.")]
    out: Annotated[Path, written("Folder of the run; an earlier run in it is resumed.")] = Path(
        "runs/train-walk"
    )
    seed: Annotated[int, seed_of("the training")] = 0
    steps: Annotated[
        int,
        typer.Option(
            help="Control steps of all robots together, rounded up to a multiple of 307,200.",
            min=1,
        ),
    ] = 48_000_000
    threads: Annotated[
        int | None,
        typer.Option(
            help="Number of processes that share the robots; by default one for each processor "
            "core.",
            min=1,
        ),
    ] = None
    no_hidden_noise: Annotated[
        bool,
        typer.Option("--no-hidden-noise", help="Train without the noise that stands for spikes."),
    ] = False


@dataclass(frozen=True, kw_only=True)
class SweepRequest:
    """A sweep, as the user asked for it, or as a figure of the paper needs it.

    ``first_seed`` is the first of ``n_seeds`` in a row; ``figure`` is the module that draws the
    result.
    """

    experiment: ExperimentName
    vary: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=VALUE,...",
            help="Values of a setting, or of `backend`; separated by `;` if a value has commas; "
            "repeatable.",
            default_factory=list,
            show_default=False,
        ),
    ]
    n_seeds: Annotated[
        int, typer.Option("--seeds", help="Number of seeds, starting at 0.", min=1, max=MOST_POINTS)
    ] = 1
    target: Target
    seconds: SecondsOption = None
    settings: SettingsOption
    probes: Annotated[
        bool, typer.Option("--probes", help="Keep the time series of each run, too.")
    ] = False
    out: Annotated[
        Path | None,
        written("Folder of the sweep, by default a new one in runs/; an earlier sweep is resumed."),
    ] = None
    no_cache: NoCache = False
    workers: Workers
    first_seed: int = 0
    figure: str = "spikeport.experiments.sweep.figure"


@dataclass(frozen=True, kw_only=True)
class EvaluateRequest:
    """An evaluation, as the user asked for it."""

    experiment: Annotated[str, typer.Argument(help="The policy's experiment: walk.")]
    rows: Annotated[
        list[str],
        typer.Option(
            "--row",
            metavar="KEY=VALUE,...",
            help="Perturbations of a row; replaces all default rows but the nominal; repeatable.",
            default_factory=list,
            show_default=False,
        ),
    ]
    episodes: Annotated[
        int, typer.Option(help="Number of episodes for each row.", min=1, max=MOST_POINTS)
    ] = 20
    seed: Annotated[int, seed_of("the first episode; each further episode has the next")] = 0
    target: Target
    seconds: Annotated[
        float | None, typer.Option(help="Length of an episode, in s; by default 20.")
    ] = None
    settings: SettingsOption
    out: Annotated[
        Path | None,
        written(
            "Folder of the evaluation, by default a new one in runs/; an earlier one is resumed."
        ),
    ] = None
    no_cache: NoCache = False
    workers: Workers
