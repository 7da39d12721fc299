"""The training run: segments of updates, each followed by a checkpoint.

A segment starts with fresh robots and with random numbers that depend only on the run's seed, the
segment and the worker: a run that was killed continues from its last checkpoint exactly as if it
had not been killed.
"""

import json
import math
import time
from contextlib import closing
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch

from spikeport.atomic import write_text
from spikeport.cache import own_version
from spikeport.digest import digest_of
from spikeport.errors import UsageError
from spikeport.progress import Progress, silent
from spikeport.training import checkpoint
from spikeport.training.checkpoint import Checkpoint, Entry
from spikeport.training.curriculum import STAGES, Stage, stage_at
from spikeport.training.environment import TrainingTask, WalkEnvironment
from spikeport.training.evaluate import evaluate
from spikeport.training.learner import Learner, LearnerOptions, mean_figures
from spikeport.training.workers import Worker, others

EVALUATION_SEED = 10_000
RARER = 4
"""Evaluations are this many times rarer before the run's last stage: only a checkpoint of the last
stage is chosen."""


@dataclass(frozen=True)
class TrainOptions:
    """A training run.

    ``steps`` is its length in control steps of all robots together, rounded up to whole segments;
    ``workers`` processes share the robots. The policy is evaluated in ``episodes`` episodes at the
    end, and after every ``evaluate_every`` segments of the last stage, more rarely before.
    """

    folder: Path
    seed: int = 0
    steps: int = 48_000_000
    learner: LearnerOptions = field(default_factory=LearnerOptions)
    updates_per_segment: int = 25
    stages: tuple[Stage, ...] = STAGES
    evaluate_every: int = 4
    episodes: int = 100
    workers: int = 2

    @property
    def goal(self) -> TrainingTask:
        """The task that checkpoints are judged by: that of the last stage."""
        return self.stages[-1].task

    @property
    def steps_per_segment(self) -> int:
        """Control steps from one checkpoint to the next."""
        return self.updates_per_segment * self.learner.steps

    @property
    def segments(self) -> int:
        """Number of segments of the whole run."""
        return -(-self.steps // self.steps_per_segment)

    def evaluates(self, segment: int) -> bool:
        """Return whether the policy is evaluated after a segment, the first of which is 0."""
        stage, last = (
            stage_at(each * self.steps_per_segment, self.stages)
            for each in (segment, self.segments - 1)
        )
        every = self.evaluate_every * (1 if stage == last else RARER)
        return (segment + 1) % every == 0 or segment + 1 == self.segments

    def identity(self) -> dict[str, object]:
        """Return the settings that must be the same when a run continues."""
        return {
            "spikeport": own_version(),
            "seed": self.seed,
            "updates_per_segment": self.updates_per_segment,
            "threads": self.workers,
            "hidden_noise": any(stage.hidden_noise for stage in self.stages),
            "stages": digest_of(self.stages)[:12],
            **asdict(self.learner),
        }


def train(options: TrainOptions, progress: Progress) -> list[Entry]:
    """Train, or continue training, until all steps are done; return the figures of every segment.

    Raises
    ------
    UsageError
        The folder holds a run with other options, or a longer one; or there are more processes than
        robots.
    WorkerLostError
        Another process of the training has ended.
    """
    if options.workers > options.learner.robots:
        raise UsageError(
            f"--threads {options.workers}: each of these processes needs one of the "
            f"{options.learner.robots} robots; cure: --threads {options.learner.robots} or less"
        )
    first = Worker(0, options.workers)
    learner, done, log = _start(options, first)
    if done > options.segments:
        raise UsageError(
            f"'{options.folder}' holds {done} segments, --steps asks for {options.segments}; "
            f"cure: --steps {done * options.steps_per_segment} or more, or another --out"
        )
    # A run may have ended between its last checkpoint and the log.
    _write_log(options.folder, log)
    with others(options.workers - 1, _help, options):
        for segment in range(done, options.segments):
            log.append(_segment(learner, options, segment, progress))
            state = Checkpoint(options.identity(), segment + 1, learner.state(), log)
            checkpoint.save(options.folder, state)
            _write_log(options.folder, log)
    return log


def _write_log(folder: Path, log: list[Entry]) -> None:
    write_text(folder / "log.jsonl", "".join(_line(entry) + "\n" for entry in log))


def _line(entry: Entry) -> str:
    """Return an entry in JSON, which has no infinities: null where nothing was counted."""
    finite = (
        (name, None if isinstance(value, float) and not math.isfinite(value) else value)
        for name, value in entry.items()
    )
    return json.dumps(dict(finite), allow_nan=False)


def _help(worker: Worker, options: TrainOptions) -> None:
    """Take part in all segments that are left, as a worker other than the first."""
    learner, done, _ = _start(options, worker)
    for segment in range(done, options.segments):
        _learn(learner, options, segment, silent)


def _start(options: TrainOptions, worker: Worker) -> tuple[Learner, int, list[Entry]]:
    """Return the learner, new or as it was left, the number of segments done, and their figures."""
    # Workers run side by side: more threads would only take cores from each other.
    torch.set_num_threads(1)
    torch.manual_seed(options.seed)
    learner = Learner(options.learner, worker)
    path = checkpoint.latest(options.folder)
    if path is None:
        return learner, 0, []
    last = checkpoint.load(path)
    for key, value in options.identity().items():
        held = last.options.get(key)
        if held != value:
            kept = f"no {key}" if held is None else f"{key} {held}"
            raise UsageError(
                f"'{options.folder}' holds a run with {kept}, not {value}; "
                f"choose another --out, or the same {key} to go on"
            )
    with checkpoint.refusing(path):
        learner.load(last.learner)
    return learner, last.segment, last.log


def _segment(learner: Learner, options: TrainOptions, segment: int, progress: Progress) -> Entry:
    """Train for one segment; return its figures, with an evaluation if it is due."""
    step = segment * options.steps_per_segment
    stage = stage_at(step, options.stages)
    start = time.perf_counter()
    figures = _learn(learner, options, segment, progress)
    seconds = time.perf_counter() - start
    step += options.steps_per_segment
    entry = {"segment": segment + 1, "step": step, "stage": stage.name, "seconds": seconds}
    entry |= figures
    if options.evaluates(segment):
        progress(f"{step / 1e6:.1f} M steps: evaluating", step / options.steps)
        entry |= asdict(
            evaluate(
                learner.policy(),
                options.goal,
                episodes=options.episodes,
                seed=EVALUATION_SEED,
                threads=options.workers,
            )
        )
    return entry


def _learn(
    learner: Learner, options: TrainOptions, segment: int, progress: Progress
) -> dict[str, float]:
    stage = stage_at(segment * options.steps_per_segment, options.stages)
    # Seeded anew, so that a run that continues from a checkpoint draws the same numbers as one
    # without a break.
    parts = [options.seed, segment, learner.worker.rank]
    seed = int(np.random.SeedSequence(parts).generate_state(1)[0])
    torch.manual_seed(seed)
    learner.begin(stage)
    log: list[dict[str, float]] = []
    with closing(WalkEnvironment(learner.robots, stage.task, seed, threads=1)) as env:
        env.spread_ages()
        for update in range(options.updates_per_segment):
            log.append({**learner.collect(env), **learner.update()})
            step = segment * options.steps_per_segment + (update + 1) * options.learner.steps
            progress(
                f"{step / 1e6:.1f} M steps, {stage.name}: reward {log[-1]['reward']:.2f} /s, "
                f"{log[-1]['falls']:.2f} falls /s",
                step / options.steps,
            )
    return mean_figures(log)
