"""The walk on a robot behind its interface, with faults that the controllers may not survive.

    python benchmarks/robot_faults.py analytic     # the exact controllers
    python benchmarks/robot_faults.py native       # follower and policy in spikes, on the chip
    python benchmarks/robot_faults.py native --only none --estimator ekf --estimator leg-odometry

It prints a line for each plan and estimator: how many of the seeds walked all the time, and when
the others fell; nan if the controller refused a state, damped the robot and ended the run.
"""

import argparse
import dataclasses
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from arguments import at_least

from spikeport import cache
from spikeport.errors import RobotLostError
from spikeport.experiments.driver import Ready, perform, prepare
from spikeport.experiments.options import Options
from spikeport.experiments.walk.metrics import metrics
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.trial import EXPERIMENT, WalkTrial
from spikeport.robot.estimator.registry import ESTIMATORS, TRUTH
from spikeport.robot.link.connection import RobotOptions, connect
from spikeport.robot.link.motion import EstimatedMotion
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
    """A walk on an inline robot whose faults and estimator are chosen for each run."""

    plan: tuple[str, ...] = ()
    estimator = TRUTH

    def plant(self) -> Plant:
        """Make the robot with the faults of the plan."""
        return LinkedPlant(
            lambda settings: connect(
                RobotOptions("inline", faults=self.plan, estimator=self.estimator), settings
            ),
            lambda held: EstimatedMotion(self.estimator, held),
        )


class Walked(NamedTuple):
    """The outcome of a walk.

    Attributes
    ----------
    fallen_at_s : float or None
        Time of its fall, None without one; nan if the robot was damped before the end.
    off_path_m : float
        Distance of the robot from its path, rms; nan if it was damped.
    estimator : dict or None
        Figures of the estimator, as in ``result.json``.
    """

    fallen_at_s: float | None
    off_path_m: float = math.nan
    estimator: dict[str, Any] | None = None


def walks(trial: FaultyWalk, ready: Ready[Any], seeds: int) -> Iterator[Walked]:
    """Yield the outcome of each seed's walk, with the trial's plan and estimator."""
    for seed in range(seeds):
        trial.options = dataclasses.replace(trial.options, seed=seed)
        try:
            run = perform(trial, ready)
        except RobotLostError as error:
            print(f"  seed {seed}: {error}", flush=True)
            yield Walked(math.nan)
            continue
        link, off_path_m = ready.closed.rig.plant.link, metrics(run)["cross_track_rms_m"]
        assert isinstance(off_path_m, float)
        yield Walked(run.fallen_at_s, off_path_m, link["estimator"])


def described(walked: list[Walked]) -> str:
    """Return a line on some walks; places and headings are those of the worst seed."""
    fell = [one.fallen_at_s for one in walked]
    falls = ", ".join(f"{at:.1f}" for at in fell if at is not None)
    line = f"walked {fell.count(None)} of {len(fell)}; fell at {falls or '-'} s"
    judged = [
        (one.off_path_m, found)
        for one in walked
        if (found := one.estimator) and found["velocity_error_m_s"]
    ]
    estimates = [found for _, found in judged]
    if not estimates:
        return line
    velocity = np.mean([one["velocity_error_m_s"] for one in estimates], axis=0)
    place_m, heading_rad = (
        max(one[key] for one in estimates) for key in ("place_error_m", "heading_error_rad")
    )
    own_m = [one["place_deviation_m"] for one in estimates]
    own = "-" if None in own_m else f"{max(own_m):.3f}"
    return (
        f"{line}; off the path {max(off_path_m for off_path_m, _ in judged):.3f} m, velocity error "
        f"{', '.join(f'{v:.3f}' for v in velocity)} m/s, place error {place_m:.2f} m (own estimate "
        f"{own} m), heading error {1000 * heading_rad:.0f} mrad"
    )


def main() -> None:
    """Walk with every chosen plan and estimator, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("backend", choices=("analytic", "native"))
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--seeds", type=at_least(1), default=3)
    parser.add_argument("--only", help="plans that begin with this; none for no fault")
    parser.add_argument("--estimator", action="append", choices=ESTIMATORS)
    asked = parser.parse_args()
    named = {" ".join(plan) or "none": plan for plan in PLANS}
    chosen = [name for name in named if name.startswith(asked.only or "")]
    if not chosen:
        parser.error(f"--only {asked.only}: no plan begins so; choose from: {', '.join(named)}")
    pipeline = EXPERIMENT.pipeline
    options = Options(
        seconds=asked.seconds, backend=asked.backend, pipeline=pipeline, cache=cache.of_user()
    )
    trial = FaultyWalk(WalkSettings(path="figure-eight"), options)
    ready = prepare(trial)
    with ready.sim:
        for estimator in asked.estimator or [TRUTH]:
            trial.estimator = estimator
            for name in chosen:
                trial.plan = named[name]
                line = described(list(walks(trial, ready, asked.seeds)))
                print(f"{estimator:12} {name:24} {line}", flush=True)


if __name__ == "__main__":
    main()
