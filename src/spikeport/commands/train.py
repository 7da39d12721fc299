"""``spikeport train``."""

from dataclasses import asdict

from spikeport.atomic import check_results_folder, locked
from spikeport.commands.console import Console, ScreenTable
from spikeport.commands.ending import resumable
from spikeport.commands.options import Workers
from spikeport.commands.options_of_experiments import TrainRequest
from spikeport.commands.progress import progress_bar
from spikeport.errors import unknown
from spikeport.extras import missing

POLICIES = ("walk",)


def run(request: TrainRequest) -> None:
    """Train a policy, or resume its training, and print how it walks."""
    policy, out, seed, steps = request.policy, request.out, request.seed, request.steps
    if policy not in POLICIES:
        raise unknown("policy", policy, POLICIES)
    check_results_folder("--out", out)
    try:
        from spikeport.training.curriculum import STAGES, without_hidden_noise
        from spikeport.training.train import TrainOptions
        from spikeport.training.walk import train_walk
    except ModuleNotFoundError as error:
        raise missing("training", error.name, "train") from error
    stages = without_hidden_noise() if request.no_hidden_noise else STAGES
    workers = Workers(n=request.threads).n_processes
    options = TrainOptions(out, seed, steps, stages=stages, workers=workers)
    command = f"spikeport train {policy} --seed {seed} --steps {steps} --threads {workers}"
    command += " --no-hidden-noise" if request.no_hidden_noise else ""
    out.mkdir(parents=True, exist_ok=True)
    with locked(out), resumable(out, "segments"), progress_bar() as progress:
        evaluations = train_walk(options, command, progress)
    table = ScreenTable("walking", *evaluations)
    rows = zip(*(asdict(e).items() for e in evaluations.values()), strict=True)
    for row in rows:
        table.add_row(row[0][0], *(f"{value:.4g}" for _, value in row))
    Console().print(table)
