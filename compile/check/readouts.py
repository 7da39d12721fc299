"""A hint on read-outs that saturated in a run, which no compile can foresee."""

from collections.abc import Iterator

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation


def readout_hints(n_spikes: int, n_steps: int) -> Iterator[Violation]:
    """Yield a hint if compartments that are read out as values have spiked ``n_spikes`` times."""
    if n_spikes:
        spikes = f"{n_spikes:,} spikes in {n_steps:,} steps"
        yield rules.get("SP406").broken("read-outs", spikes, "0")
