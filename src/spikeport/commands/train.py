"""``spikeport train``."""

import os
from dataclasses import asdict
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from spikeport.commands.progress import progress_bar
from spikeport.errors import UsageError, unknown
from spikeport.extras import missing

POLICIES = ("walk",)


def run(
    policy: str, *, out: Path, seed: int, steps: int, threads: int | None, hidden_noise: bool
) -> None:
    """Train a policy, or go on training it, and print how it walks."""
    if policy not in POLICIES:
        raise unknown("policy", policy, POLICIES)
    if out.is_file():
        raise UsageError(f"--out {out}: this is a file; give the folder of the training run")
    try:
        from spikeport.training.curriculum import STAGES, without_hidden_noise
        from spikeport.training.train import TrainOptions
        from spikeport.training.walk import train_walk
    except ModuleNotFoundError as error:
        raise missing("training", error.name, "train") from error
    stages = STAGES if hidden_noise else without_hidden_noise()
    options = TrainOptions(out, seed, steps, stages=stages, workers=threads or os.cpu_count() or 1)
    command = f"spikeport train {policy} --seed {seed} --steps {steps} --threads {options.workers}"
    command += "" if hidden_noise else " --no-hidden-noise"
    with progress_bar() as progress:
        evaluations = train_walk(options, command, progress)
    table = Table("walking", *evaluations, box=SIMPLE_HEAD)
    rows = zip(*(asdict(e).items() for e in evaluations.values()), strict=True)
    for row in rows:
        table.add_row(row[0][0], *(f"{value:.4g}" for _, value in row))
    Console().print(table)
