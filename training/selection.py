"""The choice of the checkpoint to ship, by how it walks, not by its reward.

cost = share of falls / 10 % + |vx error| / 0.05 m/s + |wz error| / 0.10 rad/s

The shortlist has the checkpoints of the smallest cost by training's evaluations, which disturb all
robots. The choice from it has the smallest cost when falls are counted in other disturbed episodes,
and errors in undisturbed ones: pushed robots have errors until they recover, which hides how
exactly a policy walks.
"""

from dataclasses import dataclass, replace

from spikeport.errors import UsageError
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.progress import Progress
from spikeport.training import checkpoint
from spikeport.training.checkpoint import Entry
from spikeport.training.environment import TrainingTask
from spikeport.training.evaluate import evaluate
from spikeport.training.learner import Learner
from spikeport.training.pace import at_asked_speeds
from spikeport.training.randomisation import UNDISTURBED
from spikeport.training.train import TrainOptions

FALLS_GOAL, VX_GOAL_M_S, WZ_GOAL_RAD_S = 0.10, 0.05, 0.10
SHORTLIST = 5
# Other episodes than those of training's evaluations, which made the shortlist.
EPISODES, SEED = 200, 20_000


@dataclass(frozen=True)
class BestCheckpoint:
    """The checkpoint that walks best: its step, its policy, its cost.

    ``factor`` is that of the policy's forward command, None if it was left as it is.
    """

    step: int
    policy: WalkingPolicy
    cost: float
    factor: float | None


def undisturbed(task: TrainingTask) -> TrainingTask:
    """Return a task with the same commands and no disturbance."""
    return replace(task, randomisation=UNDISTURBED)


def cost(falls: float, vx_error_m_s: float, wz_error_rad_s: float) -> float:
    """Return the distance of a checkpoint from its goals: 1 for each goal that it just meets.

    ``falls`` is the share of episodes that end in a fall.
    """
    return falls / FALLS_GOAL + vx_error_m_s / VX_GOAL_M_S + wz_error_rad_s / WZ_GOAL_RAD_S


def choose(options: TrainOptions, log: list[Entry], progress: Progress) -> BestCheckpoint:
    """Return the checkpoint of the smallest cost, of those that walked best in training.

    Raises
    ------
    UsageError
        No checkpoint was evaluated, or no evaluated checkpoint is left.
    """
    choices = []
    for place, entry in enumerate(shortlist(options, log)):
        progress(f"evaluating checkpoint {entry['segment']}", place / SHORTLIST)
        policy, factor = at_asked_speeds(_policy(options, entry["segment"]))
        disturbed, free = (
            evaluate(policy, task, episodes=EPISODES, seed=SEED, threads=options.workers)
            for task in (options.goal, undisturbed(options.goal))
        )
        total = cost(disturbed.fallen / EPISODES, free.vx_error_m_s, free.wz_error_rad_s)
        choices.append(BestCheckpoint(entry["step"], policy, total, factor))
    return min(choices, key=lambda choice: choice.cost)


def shortlist(options: TrainOptions, log: list[Entry]) -> list[Entry]:
    """Return the entries of the smallest cost, of those evaluated in the last stage and kept."""
    # Earlier stages ask for less: their figures are no measure of the last one.
    last = [e for e in log if "vx_error_m_s" in e and e["stage"] == log[-1]["stage"]]
    # A run that went on has more of them, as from its former end, than one without a break.
    evaluated = [e for e in last if options.evaluates(e["segment"] - 1)]
    if not evaluated:
        raise UsageError("no checkpoint was evaluated; train longer with --steps")
    # Users may delete old ones while a run goes on.
    left = [e for e in evaluated if checkpoint.path_of(options.folder, e["segment"]).is_file()]
    if not left:
        raise UsageError(
            f"no evaluated checkpoint is left in {options.folder}/checkpoints; cure: another --out"
        )
    return sorted(left, key=_cost_of)[:SHORTLIST]


def _cost_of(entry: Entry) -> float:
    falls = entry["fallen"] / entry["episodes"]
    return cost(falls, entry["vx_error_m_s"], entry["wz_error_rad_s"])


def _policy(options: TrainOptions, segment: int) -> WalkingPolicy:
    learner = Learner(options.learner)
    path = checkpoint.path_of(options.folder, segment)
    found = checkpoint.load(path)
    with checkpoint.refusing(path):
        learner.load(found.learner)
    return learner.policy()
