"""A hint on read-outs that saturated in a run, which no compile can foresee."""

from collections.abc import Iterator

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.counted import counted


def readout_hints(n_spikes: int, n_steps: int) -> Iterator[Violation]:
    """Yield a hint if compartments that are read out as values have spiked ``n_spikes`` times."""
    if n_spikes:
        spikes = f"{counted(n_spikes, 'spike')} in {counted(n_steps, 'step')}"
        yield rules.get("SP406").broken("read-outs", spikes, "0")
