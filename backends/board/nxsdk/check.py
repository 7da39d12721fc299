"""`check`: an image, written and read back from registers alone, runs as the image does."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from spikeport.backends.board.nxsdk.decompile import decompile
from spikeport.backends.board.nxsdk.findings import Finding, findings
from spikeport.backends.board.nxsdk.learning import learning_differs
from spikeport.backends.board.nxsdk.model import NOISE, Placement
from spikeport.backends.board.nxsdk.written import write
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage

SPIKING = 0.5
"""Share of the host's sources that spike in a step: half of an on/off pair does."""
COMPARED = ("u", "v", "spiked")
NO_NOISE = 0


@dataclass(frozen=True, kw_only=True)
class Checked:
    """The outcome of a check.

    Attributes
    ----------
    placement : Placement
        The core of each block.
    findings : list of Finding
        What stands between the image and a chip.
    n_cores, n_synapses, n_registers : int
        What was written; 0 if it was refused.
    n_steps, n_spikes : int
        What was compared.
    differing : mapping of str to int
        Values that differ: of u, v and spikes over all steps, of the settings of noise, and
        registers of learning.
    """

    placement: Placement
    findings: list[Finding]
    n_cores: int = 0
    n_synapses: int = 0
    n_registers: int = 0
    n_steps: int = 0
    n_spikes: int = 0
    differing: Mapping[str, int]

    @property
    def refused(self) -> bool:
        """True if nengo-loihi's hardware half does not take the image in this placement."""
        return any(found.trap.refused for found in self.findings)

    @property
    def equal(self) -> bool:
        """True if it was written, and nothing differs."""
        return not self.refused and not any(self.differing.values())


def check(image: ChipImage, placement: Placement, n_steps: int, seed: int = 0) -> Checked:
    """Write an image, make an image of the registers alone, and step both.

    Noise is compared by its settings, and is off while both are stepped, as no register holds its
    seed; so is learning.

    Parameters
    ----------
    image : ChipImage
        The image.
    placement : Placement
        The core of each block.
    n_steps : int
        Steps to compare.
    seed : int
        Seed of the host's spikes.

    Raises
    ------
    BackendError
        If nengo-loihi's hardware half refuses the image for a reason that is no finding.
    """
    found = findings(image, placement)
    if any(one.trap.refused for one in found):
        return Checked(placement=placement, findings=found, differing={})
    written = write(image, placement)
    back = decompile(written, image.manifest.dt_s)
    order = placement.compartments(image)
    states, n_spikes = _stepped(image, back, order, n_steps, seed)
    return Checked(
        placement=placement,
        findings=found,
        n_cores=back.n_cores,
        n_synapses=len(back.synapses),
        n_registers=sum(core.n_registers for core in written.board.cores),
        n_steps=n_steps,
        n_spikes=n_spikes,
        differing={
            **states,
            "noise": _noise_differs(image, back, order),
            "learning": len(learning_differs(image, placement, written)),
        },
    )


def _stepped(
    image: ChipImage, back: ChipImage, order: np.ndarray, n_steps: int, seed: int
) -> tuple[dict[str, int], int]:
    """Return the number of values of each state that differ over all steps, and of spikes."""
    one, other = NativeChip(quiet(image), seed), NativeChip(quiet(back), seed)
    rng = np.random.default_rng(seed)
    n, n_spikes, differing = image.n_compartments, 0, dict.fromkeys(COMPARED, 0)
    for _ in range(n_steps):
        spikes = np.flatnonzero(rng.random(image.n_inputs) < SPIKING)
        one.step(spikes, {})
        other.step(spikes, {})
        for name in COMPARED:
            mine, theirs = getattr(one.state, name)[:n], getattr(other.state, name)[:n]
            differing[name] += int((mine[order] != theirs).sum())
        n_spikes += int(one.state.spiked[:n].sum())
    return differing, n_spikes


def quiet(image: ChipImage) -> ChipImage:
    """Return an image without noise and learning."""
    state, groups = image.compartments, image.groups
    return replace(
        image,
        compartments=replace(state, enable_noise=np.full(len(state), NO_NOISE)),
        groups=replace(groups, learning=np.zeros_like(groups.learning)),
    )


def _noise_differs(image: ChipImage, back: ChipImage, order: np.ndarray) -> int:
    """Return the number of compartments whose noise is set otherwise."""
    mine, theirs = (one.compartments.enable_noise for one in (image, back))
    differs = mine[order] != theirs
    for name in NOISE:
        a = getattr(image.blocks, name)[image.compartment_block][order]
        b = getattr(back.blocks, name)[back.compartment_block]
        differs |= (a != b) & (theirs == 1)
    return int(differs.sum())
