"""One spiking humanoid walks, draws, retracts its arm and walks on (paper, sec. 4.3, Fig. 1, 6)."""

import nengo

from spikeport.experiments.calibration import Calibration
from spikeport.experiments.closed_loop import BACKENDS
from spikeport.experiments.options import Experiment, Options, Outcome
from spikeport.experiments.switch import controller
from spikeport.experiments.switch import run as switch_run
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.switch.trial import SwitchTrial

LONGEST_S = 60.0
"""Of a schedule, where no time is asked for; a run ends with its schedule."""


def run(settings: SwitchSettings, options: Options) -> Outcome:
    """Run the experiment and write its folder."""
    return switch_run.run(SwitchTrial.of(settings, options))


def check(settings: SwitchSettings, options: Options) -> None:
    """Refuse a schedule that cannot be followed, and a policy that is not for this robot."""
    SwitchTrial.of(settings, options).goals(options.seed)
    settings.walking_policy()


def calibrate(settings: SwitchSettings, options: Options) -> Calibration:
    """Refit the policy's read-out where it runs."""
    return controller.calibrate(SwitchTrial.of(settings, options))


def network(settings: SwitchSettings, options: Options) -> nengo.Network:
    """Arm, path follower, policy, action selection and robot, at the start of the schedule."""
    trial = SwitchTrial.of(settings, options)
    closed = switch_run.closed(trial)
    closed.loop.start(options.seed, trial.goals(options.seed))
    return closed.network


EXPERIMENT = Experiment(
    name=SwitchTrial.name,
    summary="the robot walks, draws a digit, and walks on",
    settings=SwitchSettings,
    run=run,
    backends=BACKENDS,
    seconds=LONGEST_S,
    shortest_s=0.02,
    pipeline="compact",
    calibrate=calibrate,
    network=network,
    check=check,
)
