"""Chooses the checkpoint to ship by how it walks, not by its reward.

rank = (falls, |vx error| / 0.06 m/s + |wz error| / 0.10 rad/s), the smallest first

It is the one that walks best under hard pushes, among the checkpoints that walked best as trained:
as trained so few robots fall that chance would choose.
"""

from dataclasses import dataclass, replace
from pathlib import Path

from spikeport.errors import UsageError
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.progress import Progress
from spikeport.training import checkpoint
from spikeport.training.checkpoint import Entry
from spikeport.training.environment import TrainingTask
from spikeport.training.evaluate import evaluate
from spikeport.training.learner import Learner, LearnerOptions

VX_GOAL_M_S, WZ_GOAL_RAD_S = 0.06, 0.10
SHORTLIST = 3
HARD_PUSH_M_S = 0.4
# Other episodes than those of training's evaluations, which made the shortlist.
EPISODES, SEED = 200, 20_000


@dataclass(frozen=True)
class BestCheckpoint:
    """The checkpoint that walks best: its segment and step, its policy, and its rank."""

    segment: int
    step: int
    policy: WalkingPolicy
    rank: tuple[int, float]


def pushed_hard(task: TrainingTask) -> TrainingTask:
    """Return a task with pushes of 0.4 m/s."""
    return replace(task, randomisation=replace(task.randomisation, push_m_s=HARD_PUSH_M_S))


def rank(falls: int, vx_error_m_s: float, wz_error_rad_s: float) -> tuple[int, float]:
    """Return a checkpoint's rank: the smaller, the better."""
    return falls, vx_error_m_s / VX_GOAL_M_S + wz_error_rad_s / WZ_GOAL_RAD_S


def choose(
    folder: Path, log: list[Entry], task: TrainingTask, learner: LearnerOptions, progress: Progress
) -> BestCheckpoint:
    """Return the best under hard pushes of the checkpoints that walked best in training.

    Raises
    ------
    UsageError
        No checkpoint was evaluated.
    """
    choices = []
    for place, entry in enumerate(shortlist(log)):
        progress(f"evaluating checkpoint {entry['segment']}", place / SHORTLIST)
        policy = _policy(folder, entry["segment"], learner)
        result = evaluate(policy, pushed_hard(task), episodes=EPISODES, seed=SEED)
        choices.append(
            BestCheckpoint(entry["segment"], entry["step"], policy, _rank_of(vars(result)))
        )
    return min(choices, key=lambda choice: choice.rank)


def shortlist(log: list[Entry]) -> list[Entry]:
    """Return the entries that walked best, of those evaluated in the last stage."""
    # Earlier stages ask for less: their figures are no measure of the last one.
    evaluated = [e for e in log if "vx_error_m_s" in e and e["stage"] == log[-1]["stage"]]
    if not evaluated:
        raise UsageError("no checkpoint was evaluated; train longer with --steps")
    return sorted(evaluated, key=_rank_of)[:SHORTLIST]


def _rank_of(figures: Entry) -> tuple[int, float]:
    return rank(figures["fallen"], figures["vx_error_m_s"], figures["wz_error_rad_s"])


def _policy(folder: Path, segment: int, options: LearnerOptions) -> WalkingPolicy:
    learner = Learner(options)
    path = checkpoint.path_of(folder, segment)
    found = checkpoint.load(path)
    with checkpoint.refusing(path):
        learner.load(found.learner)
    return learner.policy()
