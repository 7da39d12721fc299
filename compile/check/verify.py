"""Placement -> violations: every limit of the chip on every core, all at once."""

import math
from collections.abc import Sequence

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.placing.load import PROFILES, SHARED, core_loads
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.limits import CoreUse, Usage, usages

CHECKED = ("clipping", "noise")


def verify(cores: Sequence[CoreUse], chip: ChipModel) -> list[Violation]:
    """Return every limit that is exceeded, with the smallest change that helps."""
    return [_violation(usage) for usage in usages(cores, chip) if usage.exceeded]


def verify_settings(image: ChipImage, chip: ChipModel) -> list[Violation]:
    """Return every core whose blocks cannot share its settings of clipping and noise."""
    return [
        rules.get("SP108").broken(label, f"{mask.bit_count()} of {name}")
        for label, load in zip(image.cores, core_loads(image, chip), strict=True)
        for name, mask in zip(SHARED, load.profiles[len(PROFILES) :], strict=True)
        if name in CHECKED and mask.bit_count() > 1
    ]


def _violation(usage: Usage) -> Violation:
    rule = rules.named(usage.resource.replace("_", "-"))
    assert usage.limit is not None  # what is exceeded is known
    parts = math.ceil(usage.used / usage.limit)
    return rule.broken(usage.object, f"{usage.used:,}", f"{usage.limit:,}", parts=parts)
