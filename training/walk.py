"""``spikeport train walk``: trains, chooses, evaluates, and writes policy and model card."""

from dataclasses import replace

from spikeport.atomic import write_text
from spikeport.training.card import card
from spikeport.training.evaluate import Evaluation, evaluate
from spikeport.training.progress import Progress
from spikeport.training.randomisation import UNDISTURBED, Randomisation
from spikeport.training.selection import choose
from spikeport.training.train import EVALUATION_SEED, TrainOptions, train

NAME = "h1_walk"


def train_walk(options: TrainOptions, command: str, progress: Progress) -> dict[str, Evaluation]:
    """Write ``h1_walk.npz`` and ``h1_walk.md`` into the run's folder.

    Returns how the policy walks: ``"as trained"`` with the delays and disturbances of the last
    stage, ``"exact targets"`` without offsets and noise of the joint targets, ``"undisturbed"``
    without any.
    """
    log = train(options, progress)
    trained = tuple(stage for stage in options.stages if stage.first_step < log[-1]["step"])
    task = options.goal
    choice = choose(options.folder, log, task, options.learner, progress)
    evaluations = {"as trained": choice.evaluation}
    for robots, disturbances in _fewer(task.randomisation).items():
        progress(f"evaluating robots that are {robots}", None)
        eased = replace(task, randomisation=disturbances)
        evaluations[robots] = evaluate(
            choice.policy, eased, episodes=options.episodes, seed=EVALUATION_SEED
        )
    made = {
        "command": command,
        "seed": options.seed,
        "step": choice.step,
        "robots": options.learner.robots,
    }
    choice.policy.save(options.folder / f"{NAME}.npz")
    text = card(NAME, made, evaluations, trained)
    write_text(options.folder / f"{NAME}.md", text)
    return evaluations


def _fewer(disturbances: Randomisation) -> dict[str, Randomisation]:
    exact = replace(disturbances, joint_offset_sd_rad=0.0, action_noise_sd=0.0)
    return {"exact targets": exact, "undisturbed": UNDISTURBED}
