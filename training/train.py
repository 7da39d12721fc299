"""The training run: segments of updates, each followed by a checkpoint.

A segment starts with fresh robots and with random numbers that depend on the run's seed and the
segment's number alone: a run that was killed goes on from its last checkpoint exactly as if it had
not been.
"""

import json
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from spikeport.atomic import write_text
from spikeport.errors import UsageError
from spikeport.training import checkpoint
from spikeport.training.checkpoint import Checkpoint
from spikeport.training.curriculum import STAGES, Stage, stage_at
from spikeport.training.environment import WalkEnvironment
from spikeport.training.evaluate import evaluate
from spikeport.training.export import policy_of
from spikeport.training.learner import Learner, LearnerOptions, mean_figures
from spikeport.training.progress import Progress

EVALUATION_SEED = 10_000


@dataclass(frozen=True)
class TrainOptions:
    """A training run.

    ``steps`` is its length in control steps of all robots together, a multiple of segments being
    done; every ``evaluate_every`` segments and at the end the policy walks ``episodes`` episodes.
    """

    folder: Path
    seed: int = 0
    steps: int = 18_000_000
    learner: LearnerOptions = field(default_factory=LearnerOptions)
    updates_per_segment: int = 25
    stages: tuple[Stage, ...] = STAGES
    evaluate_every: int = 4
    episodes: int = 100
    threads: int = 2

    @property
    def steps_per_segment(self) -> int:
        """Control steps from one checkpoint to the next."""
        return self.updates_per_segment * self.learner.steps

    @property
    def segments(self) -> int:
        """Number of segments of the whole run."""
        return -(-self.steps // self.steps_per_segment)

    def identity(self) -> dict[str, Any]:
        """What must be the same when a run goes on."""
        return {
            "seed": self.seed,
            "updates_per_segment": self.updates_per_segment,
            **asdict(self.learner),
        }


def train(options: TrainOptions, progress: Progress) -> list[dict[str, Any]]:
    """Train, or go on training, until all steps are done; returns the figures of every segment.

    Raises
    ------
    UsageError
        The folder holds a run with other options.
    """
    torch.set_num_threads(options.threads)
    learner, done, log = _start(options)
    for segment in range(done, options.segments):
        log.append(_segment(learner, options, segment, progress))
        state = Checkpoint(options.identity(), segment + 1, learner.state(), log)
        checkpoint.save(options.folder, state)
        lines = "".join(json.dumps(entry) + "\n" for entry in log)
        write_text(options.folder / "log.jsonl", lines)
    return log


def _start(options: TrainOptions) -> tuple[Learner, int, list[dict[str, Any]]]:
    """The learner, new or as it was left, the number of segments done, and their figures."""
    torch.manual_seed(options.seed)
    learner = Learner(options.learner)
    path = checkpoint.latest(options.folder)
    if path is None:
        return learner, 0, []
    last = checkpoint.load(path)
    for key, value in options.identity().items():
        if last.options.get(key) != value:
            raise UsageError(
                f"'{options.folder}' holds a run with {key} {last.options.get(key)}, "
                f"asked for is {value}; choose another --out, or the same {key} to go on"
            )
    learner.load(last.learner)
    return learner, last.segment, last.log


def _segment(
    learner: Learner, options: TrainOptions, segment: int, progress: Progress
) -> dict[str, Any]:
    """Train for one segment; returns its figures, with an evaluation where one is due."""
    step = segment * options.steps_per_segment
    stage = stage_at(step, options.stages)
    start = time.perf_counter()
    figures = _learn(learner, options, stage, segment, progress)
    seconds = time.perf_counter() - start
    step += options.steps_per_segment
    entry = {"segment": segment + 1, "step": step, "stage": stage.name, "seconds": seconds}
    entry |= figures
    if (segment + 1) % options.evaluate_every == 0 or segment + 1 == options.segments:
        progress(f"{step / 1e6:.1f} M steps: evaluating", step / options.steps)
        policy = policy_of(learner.actor)
        entry |= asdict(
            evaluate(policy, stage.task, episodes=options.episodes, seed=EVALUATION_SEED)
        )
    return entry


def _learn(
    learner: Learner, options: TrainOptions, stage: Stage, segment: int, progress: Progress
) -> dict[str, float]:
    seed = int(np.random.SeedSequence([options.seed, segment]).generate_state(1)[0])
    torch.manual_seed(seed)
    learner.begin(stage)
    env = WalkEnvironment(options.learner.robots, stage.task, seed, options.threads)
    env.spread_ages()
    log: list[dict[str, float]] = []
    try:
        for update in range(options.updates_per_segment):
            log.append({**learner.collect(env), **learner.update()})
            step = segment * options.steps_per_segment + (update + 1) * options.learner.steps
            progress(
                f"{step / 1e6:.1f} M steps, {stage.name}: reward {log[-1]['reward']:.2f} /s, "
                f"{log[-1]['falls']:.2f} falls /s",
                step / options.steps,
            )
    finally:
        env.close()
    return mean_figures(log)
