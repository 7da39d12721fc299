"""Chooses the checkpoint to ship by how it walks, not by its reward.

rank = (falls, |vx error| / 0.06 m/s + |wz error| / 0.10 rad/s), the smallest first
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spikeport.errors import UsageError
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.training import checkpoint
from spikeport.training.environment import Task
from spikeport.training.evaluate import Evaluation, evaluate
from spikeport.training.learner import Learner, LearnerOptions
from spikeport.training.progress import Progress

VX_GOAL_M_S, WZ_GOAL_RAD_S = 0.06, 0.10
SHORTLIST = 3
LONG_EPISODES = 200
LONG_SEED = 20_000


@dataclass(frozen=True)
class Choice:
    """The checkpoint that walks best: its segment and step, its policy, and its evaluation."""

    segment: int
    step: int
    policy: WalkingPolicy
    evaluation: Evaluation


def rank(falls: int, vx_error_m_s: float, wz_error_rad_s: float) -> tuple[int, float]:
    """The smaller, the better."""
    return falls, vx_error_m_s / VX_GOAL_M_S + wz_error_rad_s / WZ_GOAL_RAD_S


def choose(
    folder: Path, log: list[dict[str, Any]], task: Task, learner: LearnerOptions, progress: Progress
) -> Choice:
    """The best of the checkpoints that walked best in training, by a longer evaluation.

    Raises
    ------
    UsageError
        No checkpoint was evaluated.
    """
    choices = []
    for place, entry in enumerate(shortlist(log)):
        progress(f"evaluating checkpoint {entry['segment']}", place / SHORTLIST)
        policy = _policy(folder, entry["segment"], learner)
        result = evaluate(policy, task, episodes=LONG_EPISODES, seed=LONG_SEED)
        choices.append(Choice(entry["segment"], entry["step"], policy, result))
    return min(choices, key=lambda c: _rank_of(vars(c.evaluation)))


def shortlist(log: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The entries that walked best, of those evaluated in the last stage."""
    evaluated = [e for e in log if "vx_error_m_s" in e and e["stage"] == log[-1]["stage"]]
    if not evaluated:
        raise UsageError("no checkpoint was evaluated; train longer with --steps")
    return sorted(evaluated, key=_rank_of)[:SHORTLIST]


def _rank_of(figures: dict[str, Any]) -> tuple[int, float]:
    return rank(figures["fallen"], figures["vx_error_m_s"], figures["wz_error_rad_s"])


def _policy(folder: Path, segment: int, options: LearnerOptions) -> WalkingPolicy:
    learner = Learner(options)
    learner.load(checkpoint.load(checkpoint.path_of(folder, segment)).learner)
    return learner.policy()
