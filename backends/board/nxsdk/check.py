"""`check`: a comparison of an image with the one that is read back from its registers alone."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from spikeport.backends.board.nxsdk.decompile import decompile
from spikeport.backends.board.nxsdk.findings import findings, spikes_read
from spikeport.backends.board.nxsdk.learning import learning_differs
from spikeport.backends.board.nxsdk.model import NOISE, Placement
from spikeport.backends.board.nxsdk.traps import SPIKE_VOLTAGE, Finding
from spikeport.backends.board.nxsdk.written import write
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage

SPIKING = 0.5
"""Share of the host's sources that spike in a step: half of an on/off pair does."""
COMPARED = ("u", "v", "spiked")


@dataclass(frozen=True, kw_only=True)
class Checked:
    """The outcome of a check.

    Attributes
    ----------
    placement : Placement
        The core of each block.
    findings : list of Finding
        The findings of the image in this placement.
    n_cores, n_synapses, n_registers : int
        Numbers of cores, synapses and registers written; 0 if the image was refused.
    n_steps, n_spikes : int
        Numbers of steps and spikes that were compared.
    n_spike_values, n_phantoms : int
        Spikes (0 or 1) that outputs would have read, and phantom spikes: see `PHANTOMS`.
    differing : mapping of str to int
        Numbers of values that differ: of u, v and spikes over all steps, of the settings of noise,
        and of registers of learning.
    """

    placement: Placement
    findings: list[Finding]
    n_cores: int = 0
    n_synapses: int = 0
    n_registers: int = 0
    n_steps: int = 0
    n_spikes: int = 0
    n_spike_values: int = 0
    n_phantoms: int = 0
    differing: Mapping[str, int]

    @property
    def refused(self) -> bool:
        """True if nengo-loihi's hardware half refuses the image in this placement."""
        return any(found.trap.refused for found in self.findings)

    @property
    def equal(self) -> bool:
        """True if the image was written, and nothing differs."""
        return not self.refused and not any(self.differing.values())


def check(image: ChipImage, placement: Placement, n_steps: int, seed: int = 0) -> Checked:
    """Write an image, make another from the registers alone, and step both.

    Noise is compared by its settings, and is off while both images step, as no register holds its
    seed. The same goes for learning, whose microcode is not public.

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
        If nengo-loihi's hardware half refuses the image for a reason that is not a finding.
    """
    found = findings(image, placement)
    if any(one.trap.refused for one in found):
        return Checked(placement=placement, findings=found, differing={})
    written = write(image, placement)
    back = decompile(written, image.manifest.dt_s)
    order = placement.compartments(image)
    stepped = _stepped(image, back, order, n_steps, seed)
    return Checked(
        placement=placement,
        findings=found,
        n_cores=back.n_cores,
        n_synapses=len(back.synapses),
        n_registers=sum(core.n_registers for core in written.board.cores),
        n_steps=n_steps,
        n_spikes=stepped.n_spikes,
        n_spike_values=n_steps * len(spikes_read(image)),
        n_phantoms=stepped.n_phantoms,
        differing={
            **stepped.differing,
            "noise": _noise_differs(image, back, order),
            "learning": len(learning_differs(image, placement, written)),
        },
    )


class _Stepped(NamedTuple):
    """Numbers of spikes and phantom spikes in all steps, and of differing values, by state."""

    n_spikes: int
    n_phantoms: int
    differing: dict[str, int]


def _stepped(
    image: ChipImage, back: ChipImage, order: np.ndarray, n_steps: int, seed: int
) -> _Stepped:
    """Step both images on the same spikes of the host."""
    # Without noise, which each chip draws for itself, and without learning: the microcode of a
    # rule is not public.
    one, other = NativeChip(quiet(image), seed), NativeChip(quiet(back), seed)
    rng, read = np.random.default_rng(seed), spikes_read(image)
    # nengo-loihi reads spikes from the register of the voltage: a spike leaves this value there.
    looks_fired = SPIKE_VOLTAGE * image.compartments.refract_delay[read]
    n_spikes, n_phantoms, differing = 0, 0, dict.fromkeys(COMPARED, 0)
    for _ in range(n_steps):
        spikes = np.flatnonzero(rng.random(image.n_inputs) < SPIKING)
        one.step(spikes, {})
        other.step(spikes, {})
        for name in COMPARED:
            mine, theirs = getattr(one.state, name), getattr(other.state, name)
            differing[name] += int((mine[order] != theirs).sum())
        n_spikes += int(one.state.spiked.sum())
        n_phantoms += int((one.state.v[read] == looks_fired).sum())
    return _Stepped(n_spikes, n_phantoms, differing)


def quiet(image: ChipImage) -> ChipImage:
    """Return an image without noise and learning."""
    state, groups = image.compartments, image.groups
    return replace(
        image,
        compartments=replace(state, enable_noise=np.zeros(len(state))),
        groups=replace(groups, learning=np.zeros_like(groups.learning)),
    )


def _noise_differs(image: ChipImage, back: ChipImage, order: np.ndarray) -> int:
    """Return the number of compartments whose settings of noise differ."""
    mine, theirs = (one.compartments.enable_noise for one in (image, back))
    differs = mine[order] != theirs
    for name in NOISE:
        a = getattr(image.blocks, name)[image.compartment_block][order]
        b = getattr(back.blocks, name)[back.compartment_block]
        # A block's settings do not matter to compartments without noise.
        differs |= (a != b) & (theirs == 1)
    return int(differs.sum())
