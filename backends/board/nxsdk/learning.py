"""The registers of learning, compared with the settings of an image.

Learning is compared but not run: nengo-loihi's source does not tell which microcode NxSDK makes
from a rule.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from nengo_loihi.builder.discretize import tracing_mag_int_frac

from spikeport.backends.board.nxsdk.groups import value
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.backends.board.nxsdk.recording import Core
from spikeport.backends.board.nxsdk.written import Written
from spikeport.compile.image.chip_image import ChipImage

RULES = ("dw = u1*x1*y1*(2^-7)", "dw = -u1*x1*y1*(2^-7)")
"""The rules of positive and negative errors; nengo-loihi scales weights to fit their rate."""
RATE = 2.0**-7


def learning_differs(image: ChipImage, placement: Placement, written: Written) -> list[str]:
    """Return the names of the registers of learning that differ from the image's, with the core.

    Parameters
    ----------
    image : ChipImage
        The image.
    placement : Placement
        The core of each block.
    written : Written
        The registers that were written for it.
    """
    core_of_group = placement.core[image.groups.block]
    learns = {core_of_group[g]: image.learning_of(g) for g in np.flatnonzero(image.learns)}
    return [
        f"core {number}: {name}"
        for number, core in enumerate(written.board.cores)
        for name in _differing(core, learns.get(number))
    ]


def _differing(core: Core, expected: Mapping[str, float] | None) -> Iterator[str]:
    """Yield the registers of a core that differ from a group's settings, or have no group."""
    enabled = core.synapses.column("LrnEn")
    if (enabled != (expected is not None)).any():
        yield "LrnEn"
    if expected is None:
        return
    trace = core.bank("stdpPreCfg")[0]
    magnitude = tracing_mag_int_frac(expected["tracing_mag"])
    if (value(trace, "spikeLevelInt"), value(trace, "spikeLevelFrac")) != magnitude:
        yield "stdpPreCfg.spikeLevel"
    if value(trace, "tau") != expected["tracing_tau"]:
        yield "stdpPreCfg.tau"
    rules: list[object] = [core.bank("stdpUcodeMem")[i].word for i in range(2)]
    if rules != list(RULES):
        yield "stdpUcodeMem"
    if expected["lr_int"] * 2.0 ** expected["lr_exp"] != RATE:
        yield "learning rate"
    yield from _axons_differing(core)


def _axons_differing(core: Core) -> Iterator[str]:
    """Yield registers of wrong axons: an entry that names the trace has to follow each axon."""
    entries = core.bank("synapseMap")
    axons = [number for number, entry in entries.items() if "synapsePtr" in vars(entry)]
    traced = [n + 1 for n in axons if "singleTraceEntry" in vars(entries.get(n + 1, core))]
    if len(traced) != len(axons) or len(entries) != 2 * len(axons):
        yield "synapseMap.singleTraceEntry"
    if value(core.numUpdates, "numStdp") != len(axons):
        yield "numUpdates.numStdp"
