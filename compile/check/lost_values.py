"""Hints on values that were lost in a run, which no compile can foresee."""

import contextlib
import warnings
from collections.abc import Iterable, Iterator, Mapping

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.counted import counted
from spikeport.hardware_models.activity import Activity

SATURATED = 0.01
"""Share of steps in which spikes of an input are lost, above which a hint is due."""


def hints_after(run: Activity, hints: Iterable[Violation]) -> Iterator[Violation]:
    """Yield the hints of a compile and of its run, which knows the values that were cut off."""
    yield from (one for one in hints if one.id != "SP421" or one.object not in run.cut_off)
    yield from lost_values(run)


def lost_values(activity: Activity) -> Iterator[Violation]:
    """Yield the hints on values that read-outs and inputs lost in a run."""
    yield from readout_hints(activity.readout_spikes, activity.n_steps)
    yield from input_hints(activity.saturated_inputs)


def readout_hints(n_spikes: int, n_steps: int) -> Iterator[Violation]:
    """Yield a hint if compartments that are read out as values have spiked ``n_spikes`` times."""
    if n_spikes:
        spikes = counted(n_spikes, "spike"), counted(n_steps, "step")
        yield rules.get("SP406").broken("read-outs", " in ".join(spikes), "0")


def input_hints(shares: Mapping[str, float]) -> Iterator[Violation]:
    """Yield a hint on each input whose values are cut off, in a share of steps worth a hint."""
    for name, share in shares.items():
        if share > SATURATED:
            yield rules.get("SP408").broken(name, f"spikes lost in {100 * share:.0f} % of steps")


@contextlib.contextmanager
def cut_off_by_design() -> Iterator[None]:
    """Silence the warning of inputs that are cut off, where ranges are quantiles of the values.

    Reports of runs have the hint all the same.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "SP408 ")
        yield
