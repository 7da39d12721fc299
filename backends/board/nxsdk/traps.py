"""The traps on the way to a real chip: each has an id, which keeps its meaning, and a cure."""

from typing import NamedTuple

MOST_THRESHOLDS, MOST_PROFILES = 7, 31
"""Profiles of thresholds and of compartments that nengo-loihi's builder accepts on a core: it
asserts fewer than the 8 and 32 of the chip."""
MOST_BASE = 256
"""The largest compartment that targets may count from: nengo-loihi's builder asserts it."""
DEFAULT_SPIKES = 50
"""The default of nengo-loihi's ``snip_max_spikes_per_step``."""
SPIKE_VOLTAGE = 128
"""Snips take a voltage of this number times the refractory delay for a spike."""
SINGLE = "one block a core: compile with -p unpacked, or compact_unpacked"


class Trap(NamedTuple):
    """A way to go wrong: its id and name, whether nengo-loihi refuses it, and the cure.

    The numbers of profiles (NX01, NX15) are refused on a board alone: `check` and `snips` raise
    nengo-loihi's limits to the chip's.
    """

    id: str
    name: str
    refused: bool
    cure: str


# An id, once used, keeps its meaning.
THRESHOLDS = Trap("NX01", "threshold profiles of a core", False, SINGLE)
NOISES = Trap("NX02", "noise settings of a core", True, SINGLE)
RANGES = Trap("NX03", "voltage ranges of a core", True, SINGLE)
POPULATIONS = Trap("NX04", "population axons of a shared core", True, SINGLE)
LEARNERS = Trap(
    "NX05",
    "groups of synapses on a core that learns",
    True,
    f"{SINGLE}; split a block that learns twice into two blocks",
)
DUMMIES = Trap(
    "NX06",
    "axon without synapses at the end of a group",
    True,
    "the pass merge_axons, which is in all named pipelines, drops it",
)
BASES = Trap("NX07", "compartment that targets count from", True, "convolve fewer neurons at once")
SPIKES = Trap(
    "NX08",
    "host spikes in a step",
    False,
    "set snip_max_spikes_per_step to that number, as `board serve --machine nxsdk` does",
)
PHANTOMS = Trap(
    "NX09",
    "phantom spikes",
    False,
    "none, nengo-loihi's issue 170 is open; more neurons or a longer filter make each weigh less",
)
INDICES = Trap(
    "NX10", "not provable offline: index bits", False, f"{SINGLE}; then run it on a board"
)
SEEDS = Trap("NX11", "noise without a seed", False, "compare spikes with noise off, rates with it")
SCATTERED = Trap(
    "NX12",
    "not provable offline: scattered targets",
    False,
    "none here: nengo-loihi writes its own sparse connections this way; a run on a board shows "
    "whether values differ",
)
REFRACTORY = Trap(
    "NX13",
    "refractory delays of a block whose spikes are read",
    True,
    "give ensembles that are fused the same tau_ref, or do not fuse them: -p unpacked",
)
SHUTDOWNS = Trap(
    "NX14",
    "values that read as a shutdown",
    False,
    "none needed on `board serve`, which reads answers itself; elsewhere, run again",
)
PROFILES = Trap("NX15", "compartment profiles of a core", False, SINGLE)


class Finding(NamedTuple):
    """A trap that an image is in: the place, and the use against the limit."""

    trap: Trap
    where: str
    used: str

    def __str__(self) -> str:
        verb = "refused: " if self.trap.refused else ""
        return (
            f"{self.trap.id} {verb}{self.trap.name}: {self.where}: {self.used}; "
            f"cure: {self.trap.cure}"
        )
