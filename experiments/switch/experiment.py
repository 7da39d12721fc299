"""One spiking humanoid walks, draws, retracts its arm and walks on (paper, sec. 4.3, Fig. 1, 6)."""

from spikeport.experiments.closed_loop import BACKENDS
from spikeport.experiments.options import Experiment, Options, Outcome
from spikeport.experiments.switch import run as switch_run
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.switch.trial import SwitchTrial

LONGEST_S = 60.0
"""Of a schedule, where no time is asked for; a run ends with its schedule."""


def run(settings: SwitchSettings, options: Options) -> Outcome:
    """Run the experiment and write its folder."""
    return switch_run.run(SwitchTrial.of(settings, options))


EXPERIMENT = Experiment(
    name=SwitchTrial.name,
    summary="the robot walks, draws a digit, and walks on",
    settings=SwitchSettings,
    run=run,
    backends=BACKENDS,
    seconds=LONGEST_S,
    shortest_s=0.02,
    pipeline="compact",
)
