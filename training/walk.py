"""The command ``spikeport train walk``: train, choose, evaluate, write policy and model card."""

from dataclasses import replace

from spikeport.atomic import write_text
from spikeport.progress import Progress
from spikeport.training.card import card
from spikeport.training.environment import TrainingTask
from spikeport.training.evaluate import Evaluation, evaluate
from spikeport.training.selection import choose, undisturbed
from spikeport.training.train import TrainOptions, train
from spikeport.training.turn_lag import with_gains

NAME = "h1_walk"
EPISODES, SEED = 200, 30_000
"""Episodes and seed of the card's evaluations, which are not used for any choice."""


def train_walk(options: TrainOptions, command: str, progress: Progress) -> dict[str, Evaluation]:
    """Write ``h1_walk.npz`` and ``h1_walk.md`` into the run's folder.

    Return the policy's evaluations: ``"as trained"`` with the delays and disturbances of the last
    stage, ``"jumping commands"`` with commands that change at once, ``"exact targets"`` without
    offsets and noise of the joint targets, ``"undisturbed"`` without any disturbance.
    """
    log = train(options, progress)
    # A stage begins with a segment: the last one may have passed the first step of the next stage.
    begun = {entry["stage"] for entry in log}
    trained = tuple(stage for stage in options.stages if stage.name in begun)
    choice = choose(options, log, progress)
    (policy, turn_lag_s), evaluations = with_gains(choice.policy), {}
    for name, other in _variants(options.goal).items():
        progress(f"evaluating: {name}", None)
        evaluations[name] = evaluate(
            policy, other, episodes=EPISODES, seed=SEED, threads=options.workers
        )
    made = {
        "command": command,
        "seed": options.seed,
        "goal": options.stages[-1].name,
        "step": choice.step,
        "robots": options.learner.robots,
        "factor": choice.factor,
        "turn_lag_s": turn_lag_s,
        "kp_speed": policy.gains.kp_speed,
        "kp_heading": policy.gains.kp_heading,
    }
    policy.save(options.folder / f"{NAME}.npz")
    text = card(NAME, made, evaluations, trained)
    write_text(options.folder / f"{NAME}.md", text)
    return evaluations


def _variants(task: TrainingTask) -> dict[str, TrainingTask]:
    jumps = replace(task.commands, jumping=1.0)
    exact = replace(task.randomisation, joint_offset_sd_rad=0.0, action_noise_sd=0.0)
    return {
        "as trained": task,
        "jumping commands": replace(task, commands=jumps),
        "exact targets": replace(task, randomisation=exact),
        "undisturbed": undisturbed(task),
    }
