"""Checks of a placement: every limit of the chip on every core, all at once."""

import math
from collections.abc import Sequence

import numpy as np

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import DELAY_BITS
from spikeport.compile.placing.load import PROFILES, SHARED, core_loads
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.limits import CoreUse, Usage, usages

CHECKED = ("clipping", "noise")
"""The settings in `SHARED` that no other rule checks."""
LONGEST_DELAY = (1 << DELAY_BITS) - 1
"""The largest refractory delay, in steps, that of the spike included."""


def verify(cores: Sequence[CoreUse], chip: ChipModel) -> list[Violation]:
    """Return a violation for every limit that is exceeded, with the smallest change that helps."""
    exceeded = [_violation(usage) for usage in usages(cores, chip) if usage.exceeded]
    return [_on_one_fpga(one, chip) for one in exceeded]


def verify_settings(image: ChipImage, chip: ChipModel) -> list[Violation]:
    """Return a violation for every core whose blocks differ in settings of clipping or noise."""
    return [
        rules.get("SP108").broken(label, f"{mask.bit_count()} of {name}")
        for label, load in zip(image.cores, core_loads(image, chip), strict=True)
        for name, mask in zip(SHARED, load.profiles[len(PROFILES) :], strict=True)
        if name in CHECKED and mask.bit_count() > 1
    ]


def verify_refractory(image: ChipImage) -> list[Violation]:
    """Return a violation for every block with a refractory delay beyond its register."""
    longest = np.maximum.reduceat(image.compartments.refract_delay, image.blocks.start[:-1])
    return [
        rules.get("SP110").broken(block.label, f"{delay - 1:,} steps")
        for block, delay in zip(image.manifest.blocks, longest, strict=True)
        if delay > LONGEST_DELAY
    ]


def verify_learning(image: ChipImage, chip: ChipModel) -> list[Violation]:
    """Return a violation for every core with synapses that learn, if the chip has no learning."""
    if chip.learns:
        return []
    groups = np.bincount(image.group_core, image.learns, minlength=1)
    return [
        rules.get("SP109").broken(image.cores[core], f"{int(groups[core]):,} groups")
        for core in np.flatnonzero(groups)
    ]


def verify_size(compartments: int, chip: ChipModel) -> list[Violation]:
    """Return a violation if a network has more compartments than all cores of a chip together.

    ``compartments`` is a lower bound, known before the network is built.
    """
    if chip.limits.compartments is None:
        return []
    at_least = math.ceil(compartments / chip.limits.compartments.count)
    if at_least <= (limit := chip.n_cores):
        return []
    parts = math.ceil(at_least / limit)
    cores = rules.get("SP201").broken(
        chip.name, f"at least {at_least:,}", f"{limit:,}", parts=parts
    )
    return [_on_one_fpga(cores, chip)]


def _on_one_fpga(found: Violation, chip: ChipModel) -> Violation:
    """Return a violation without the cure of more chips, if the chip has soft cores."""
    rule = rules.get(found.id)
    soft = rule.name == "cores" and chip.soft_memory is not None
    return found._replace(cure=rule.in_case["soft_cores"]) if soft else found


def _violation(usage: Usage) -> Violation:
    rule = rules.named(usage.resource.replace("_", "-"))
    assert usage.limit is not None  # a limit that is exceeded is public
    parts = math.ceil(usage.used / usage.limit)
    return rule.broken(usage.object, f"{usage.used:,}", f"{usage.limit:,}", parts=parts)
