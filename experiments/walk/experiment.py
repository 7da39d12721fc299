"""The H1 walks a path on spiking neurons (paper, sec. 4.2 and Fig. 6)."""

import nengo

from spikeport.experiments.calibration import Calibration
from spikeport.experiments.closed_loop import BACKENDS
from spikeport.experiments.options import Experiment, Options, Outcome
from spikeport.experiments.walk import calibration as walk_calibration
from spikeport.experiments.walk import run as walk_run
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.trial import WalkTrial


def run(settings: WalkSettings, options: Options) -> Outcome:
    """Run the experiment and write its folder."""
    return walk_run.run(WalkTrial(settings, options))


def check(settings: WalkSettings, options: Options) -> None:
    """Refuse a path that cannot be followed, and a policy that is not for this robot."""
    WalkTrial(settings, options).path()
    settings.walking_policy()


def calibrate(settings: WalkSettings, options: Options) -> Calibration:
    """Fit the policy to what its neurons do where they run."""
    return walk_calibration.calibrate(WalkTrial(settings, options))


def network(settings: WalkSettings, options: Options) -> nengo.Network:
    """Path follower, policy and robot, which stands where the path begins."""
    trial = WalkTrial(settings, options)
    closed = walk_run.closed(trial)
    closed.loop.begin(options.seed, trial.path())
    return closed.network


EXPERIMENT = Experiment(
    name=WalkTrial.name,
    summary="the robot follows a path",
    settings=WalkSettings,
    run=run,
    backends=BACKENDS,
    seconds=40.0,
    shortest_s=0.02,
    pipeline="compact",
    calibrate=calibrate,
    network=network,
    check=check,
)
