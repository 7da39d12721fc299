"""The walk on a robot behind its interface, with faults: what the controllers survive.

    python benchmarks/robot_faults.py analytic     # the exact controllers
    python benchmarks/robot_faults.py native       # follower and policy in spikes, on the chip

One line for each plan: how many of the seeds walked all the time, and when the others fell; nan
where the controller refused a state, damped the robot and ended the run.
"""

import argparse
import dataclasses
import math
from collections.abc import Iterator
from functools import partial

from spikeport.errors import RobotLostError
from spikeport.experiments.driver import Ready, perform, prepare
from spikeport.experiments.options import Options
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.trial import EXPERIMENT, WalkTrial
from spikeport.robot.link.connection import RobotOptions, connect
from spikeport.robot.link.motion import TRUTH, EstimatedMotion
from spikeport.robot.link.plant import LinkedPlant
from spikeport.robot.plant import Plant

PLANS = (
    (),
    *((f"delay={ms}:1",) for ms in (10, 20, 30, 40, 50, 60)),
    *((f"jitter={ms}:1",) for ms in (2, 5, 10, 20)),
    *((f"loss:{share}",) for share in (0.05, 0.2, 0.4, 0.6, 0.8)),
    ("delay=20:1", "loss:0.2"),
    ("duplicate:0.5",),
    ("reorder:0.2",),
    ("reorder:0.5",),
    ("nan:0.1",),
    ("mute@400",),
    ("state-delay=10:1",),
    ("state-delay=20:1",),
    ("state-delay=30:1",),
    ("state-loss:0.2",),
    ("state-loss:0.4",),
    ("state-reorder:0.2",),
    ("state-duplicate:0.5",),
    ("state-nan@400",),
    ("state-mute@400",),
    ("delay=10:1", "state-delay=10:1", "state-loss:0.1"),
)


class FaultyWalk(WalkTrial):
    """A walk on an inline robot whose faults are chosen for each run."""

    plan: tuple[str, ...] = ()

    def plant(self) -> Plant:
        return LinkedPlant(
            lambda settings: connect(RobotOptions("inline", faults=self.plan), settings),
            partial(EstimatedMotion, TRUTH),
        )


def walks(
    trial: FaultyWalk, ready: Ready, plan: tuple[str, ...], seeds: int
) -> Iterator[float | None]:
    trial.plan = plan
    for seed in range(seeds):
        trial.options = dataclasses.replace(trial.options, seed=seed)
        try:
            yield perform(trial, ready).fallen_at_s
        except RobotLostError as error:
            print(f"  seed {seed}: {error}", flush=True)
            yield math.nan


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("backend", choices=("analytic", "native"))
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", default="", help="plans that begin with this")
    asked = parser.parse_args()
    pipeline = EXPERIMENT.pipeline
    options = Options(seconds=asked.seconds, backend=asked.backend, pipeline=pipeline)
    trial = FaultyWalk(WalkSettings(), options)
    ready = prepare(trial)
    with ready.sim:
        for plan in (one for one in PLANS if " ".join(one).startswith(asked.only)):
            fell = list(walks(trial, ready, plan, asked.seeds))
            falls = ", ".join(f"{at:.1f}" for at in fell if at is not None)
            count = f"{fell.count(None)} of {asked.seeds}"
            print(
                f"{' '.join(plan) or 'none':24} walked {count}; fell at {falls or '-'} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
