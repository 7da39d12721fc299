"""Two images of the same compartments, side by side on the native chip."""

from typing import Any

import numpy as np

from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.base import Context
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from tests.helpers.side_by_side import random_spikes, snapshot

STATE = ("v", "u", "q", "spiked", "refractory", "spike_count")


def small_chip(**limits: int) -> ChipModel:
    """Return Loihi with other limits of a core."""
    loihi = chips.get("loihi")
    figures = {
        name: getattr(loihi.limits, name).model_copy(update={"value": float(limit)})
        for name, limit in limits.items()
    }
    return loihi.model_copy(update={"limits": loihi.limits.model_copy(update=figures)})


def context(chip: ChipModel | None = None, note: dict[str, Any] | None = None) -> Context:
    """Return the arguments of a pass; its notes go into a dictionary."""
    notes = {} if note is None else note
    return Context(chip or chips.get("loihi"), 0.001, notes.__setitem__)


def assert_same_run(before: ChipImage, after: ChipImage, n_steps: int = 20, seed: int = 0) -> int:
    """Assert that state and outputs are equal after every step; return the number of spikes."""
    first, second = NativeChip(before, seed), NativeChip(after, seed)
    for spikes in random_spikes(before, n_steps, seed):
        outputs = zip(first.step(spikes, {}), second.step(spikes, {}), strict=True)
        for ours, theirs in outputs:
            np.testing.assert_array_equal(ours, theirs)
        states = zip(STATE, snapshot(first), snapshot(second), strict=True)
        for name, ours, theirs in states:
            np.testing.assert_array_equal(ours, theirs, err_msg=name)
    a, b = first.activity().totals(), second.activity().totals()
    assert a["spikes"] == b["spikes"]
    assert a["readout_spikes"] == b["readout_spikes"]
    return a["spikes"]
