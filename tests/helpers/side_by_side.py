"""One image on the native backend, on nengo-loihi's emulator and on the oracle, in lock-step."""

import dataclasses
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from spikeport.backends.native.chip import NativeChip
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.oracle import Oracle


class Snapshot(NamedTuple):
    """The state of every compartment after a step."""

    v: np.ndarray
    u: np.ndarray
    q: np.ndarray
    spiked: np.ndarray
    refractory: np.ndarray
    spike_count: np.ndarray


def snapshot(chip: NativeChip | NengoLoihiChip | Oracle) -> Snapshot:
    """Return a copy of a chip's state."""
    if isinstance(chip, NengoLoihiChip):
        s = chip._emulator.compartment
        state = (s.voltage, s.current, s.input[0], s.spiked, s.ref_count, s.spike_count)
    else:
        s = chip.state if isinstance(chip, NativeChip) else chip
        state = (s.v, s.u, s.q, s.spiked[: len(s.v)], s.refractory, s.spike_count)
    return Snapshot(*(array.astype(np.int64) for array in state))


def assert_equal_steps(image: ChipImage, seed: int, steps: Iterable[np.ndarray]) -> list[Snapshot]:
    """Run all three; state and outputs after every step, and counts at the end, must be equal.

    Return the states.
    """
    native, theirs, oracle = (make(image, seed) for make in (NativeChip, NengoLoihiChip, Oracle))
    states = []
    for number, spikes in enumerate(steps, start=1):
        outputs = [chip.step(spikes, {}) for chip in (native, theirs, oracle)]
        states.append(snapshot(native))
        for name, other in (("nengo-loihi", theirs), ("the oracle", oracle)):
            _assert_same(states[-1], snapshot(other), f"step {number}, {name}")
        for ours, *others in zip(*outputs, strict=True):
            for other in others:
                np.testing.assert_array_equal(ours, other)
    assert_equal_activity(native, theirs)
    return states


def assert_equal_activity(native: NativeChip, theirs: NengoLoihiChip) -> None:
    """Assert that every count of two runs is equal."""
    ours, other = native.activity(), theirs.activity()
    for field in dataclasses.fields(ours):
        np.testing.assert_array_equal(
            getattr(ours, field.name), getattr(other, field.name), err_msg=field.name
        )


def random_spikes(image: ChipImage, n_steps: int, seed: int) -> list[np.ndarray]:
    """Return the sources that spike in each step: none, some or all sources of each input."""
    rng = np.random.RandomState(seed)
    sizes = image.inputs.size
    rates = rng.choice([0, 0.2, 1], size=(n_steps, len(sizes)))
    return [np.flatnonzero(rng.rand(sizes.sum()) < np.repeat(r, sizes)) for r in rates]


def silence(n_steps: int) -> list[np.ndarray]:
    """Return no spikes of the host."""
    return [np.zeros(0, dtype=int)] * n_steps


def _assert_same(ours: Snapshot, theirs: Snapshot, where: str) -> None:
    for name, a, b in zip(Snapshot._fields, ours, theirs, strict=True):
        np.testing.assert_array_equal(a, b, err_msg=f"{where}: {name}")
