"""Refusals of the native chip in whole sentences, before it steps, and joined steps."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from spikeport.backends.decoding import Decoder
from spikeport.backends.native.chip import NativeChip
from spikeport.errors import BackendError, ImageError
from tests.helpers.images import Block, Group, Output, Parts, Route
from tests.helpers.side_by_side import snapshot

NOTHING = np.zeros(0, dtype=int)


@pytest.fixture
def chip() -> NativeChip:
    """Return a chip of inputs of three and two sources, and a block of two compartments."""
    return NativeChip(
        Parts(
            blocks=[Block(n=2, bias=5, vth=100)],
            groups=[Group(weights=[[64, 64]])],
            inputs=[3, 2],
            routes=[Route(axon=[0, 0, 0], input=0), Route(axon=[0, 0], input=1)],
        ).image(),
        seed=0,
    )


def refusal(step: Callable[[], Any]) -> str:
    with pytest.raises(BackendError) as caught:
        step()
    return str(caught.value)


@pytest.mark.parametrize(
    ("spikes", "found"),
    [
        ([0, 5], "2 spikes of sources 0 to 5"),
        ([-1], "1 spikes of sources -1 to -1"),
        ([0, 1, 1, 2, 3, 5], "6 spikes of sources 0 to 5"),
    ],
)
def test_spikes_of_no_source_are_refused(chip: NativeChip, spikes: list[int], found: str) -> None:
    assert_refused(
        chip,
        np.array(spikes),
        f"the host sent {found}, but the image has only 5 sources, numbered from 0",
    )


@pytest.mark.parametrize(
    ("spikes", "found"),
    [
        (np.array([0.0, 1.0]), "float64 of shape (2,)"),
        (np.array([True, False]), "bool of shape (2,)"),
        (np.array([[0, 1]]), "int64 of shape (1, 2)"),
    ],
)
def test_spikes_that_are_not_numbers_of_sources_are_refused(
    chip: NativeChip, spikes: np.ndarray, found: str
) -> None:
    assert_refused(
        chip,
        spikes,
        f"the host's spikes are {found}; "
        "give the numbers of the sources that spike, as a (n,) array of integers",
    )


def assert_refused(chip: NativeChip, spikes: np.ndarray, message: str) -> None:
    """Assert that the step is refused, and leaves the chip as it was."""
    chip.step(np.array([0]), {})
    before = snapshot(chip)
    assert refusal(lambda: chip.step(spikes, {})) == message
    for a, b in zip(before, snapshot(chip), strict=True):
        np.testing.assert_array_equal(a, b)
    chip.step(NOTHING, {})
    assert chip.state.q.tolist() == [64, 64]


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int32, np.uint64])
def test_spikes_may_be_integers_of_any_width(chip: NativeChip, dtype: type) -> None:
    chip.step(np.array([0, 2, 4], dtype), {})
    chip.step(NOTHING, {})
    assert chip.state.q.tolist() == [3 * 64, 3 * 64]


def test_a_closed_chip_does_not_step(chip: NativeChip) -> None:
    chip.close()
    assert refusal(lambda: chip.step(NOTHING, {})) == (
        "the chip is closed: it cannot step any more"
    )


def test_errors_of_groups_that_do_not_learn_are_refused(chip: NativeChip) -> None:
    assert refusal(lambda: chip.step(NOTHING, {0: np.zeros(1)})) == (
        "synapse group 0 does not learn; those that do: none"
    )


def test_errors_of_another_shape_are_refused() -> None:
    rule = (1, 4, -7, 10, 8.5, 2, 4)
    parts = Parts([Block(n=4)], [Group([[0] * 4]), Group([[0] * 4], learning=rule)])
    chip = NativeChip(parts.image(), seed=0)
    assert refusal(lambda: chip.step(NOTHING, {1: np.zeros(4)})) == (
        "synapse group 1: its error has shape (4,), not (2,)"
    )
    assert refusal(lambda: chip.step(NOTHING, {0: np.zeros(2)})) == (
        "synapse group 0 does not learn; those that do: 1"
    )


@pytest.mark.parametrize(
    ("base", "index", "reason"),
    [
        (2, 1, "the farthest target of in_axons[0] is 3, at most 2"),
        (0, 3, "the farthest target of in_axons[0] is 3, at most 2"),
        (0, -1, "synapses.index[0] is -1, at least 0"),
    ],
)
def test_an_image_with_a_target_outside_its_block_is_refused(
    base: int, index: int, reason: str
) -> None:
    """nengo-loihi's emulator fails at the first spike there; a negative target wraps silently."""
    group = Group(weights=[[1]], indices=[[[index]]], axon_base=[base], block=1)
    parts = Parts([Block(n=9), Block(n=3)], [group], [1], [Route(axon=[0], input=0)])
    with pytest.raises(ImageError) as caught:
        NativeChip(parts.image(), seed=0)
    assert str(caught.value) == f"{reason}; compile it again"


@pytest.mark.parametrize(
    ("axon", "atom", "reason"),
    [
        (2, 0, "out_axons.axon[1] is 2, at most 1"),
        (1, 1, "out_axons.atom[1] is 1, at most 0"),
        (0, 3, "out_axons.atom[1] is 3, at most 2"),
        (0, -1, "out_axons.atom[1] is -1, at least 0"),
    ],
)
def test_an_image_with_a_route_to_nowhere_is_refused(axon: int, atom: int, reason: str) -> None:
    """Otherwise its spikes would be delivered to other axons."""
    group = Group(weights=[[[1], [2], [3]], [[4]]])
    route = Route(axon=[-1, axon], atom=[0, atom], input=0)
    with pytest.raises(ImageError) as caught:
        NativeChip(Parts([Block()], [group], [2], [route]).image(), seed=0)
    assert str(caught.value) == f"{reason}; compile it again"


@pytest.mark.parametrize(
    "group",
    [
        Group([[0] * 4], axon_row=[0, 0]),
        Group([[[0] * 4, [1] * 4]]),
        Group([[0] * 4], axon_base=[-1]),
        Group([[0] * 4, [0] * 4], axon_row=[1, 0]),
    ],
)
def test_learning_axons_that_are_not_plain_are_refused(group: Group) -> None:
    """nengo-loihi's emulator learns wrongly there, or fails; its builder never makes them."""
    group.learning = (1, 4, -7, 10, 8.5, 2, 4)
    with pytest.raises(ImageError) as caught:
        NativeChip(Parts([Block(n=4)], [group]).image(), seed=0)
    assert str(caught.value) == (
        "synapse group 'group 0' learns: each of its axons needs a row of its own, of one atom, "
        "and a base; compile the image again"
    )


def test_a_joined_step_equals_a_step_and_its_decoding() -> None:
    image = Parts(
        blocks=[Block(n=2, bias=5, vth=100)],
        groups=[Group(weights=[[64, -128]])],
        inputs=[3],
        routes=[Route(axon=[0, 0, 0], input=0)],
        outputs=[Output("voltage", [1, 0]), Output("spiked", [0, 1], decoded=True)],
    ).image()
    decoder, sources = Decoder(image, [1, 0]), np.zeros(3)
    inbox, values = np.zeros((2, decoder.size))
    apart, joined = NativeChip(image, 0), NativeChip(image, 0)
    step = joined.join(sources, decoder.table, inbox)
    assert step is not None
    found = []
    for i in range(30):
        sources[:] = i % 2, 0, 1000.0 * (i % 3 == 0)
        held = apart.step(np.flatnonzero(sources), {})
        decoder.decode(held, values)
        views, decoded = step()
        found.append(decoded)
        np.testing.assert_array_equal(np.concatenate(views), np.concatenate(held))
        np.testing.assert_array_equal(snapshot(joined).v, snapshot(apart).v)
        if decoded:
            np.testing.assert_array_equal(inbox, values)
    assert any(found)
    assert apart.activity().messages_host.tolist() == joined.activity().messages_host.tolist()
    assert joined.activity().n_steps == 30
    assert joined.activity().totals() == apart.activity().totals()
    joined.close()
    assert refusal(step) == "the chip is closed: it cannot step any more"


def test_a_chip_that_learns_joins_no_host() -> None:
    group = Group(weights=[[0, 0]], learning=(1, 4, -7, 10, 8.5, 2, 4))
    image = Parts([Block(n=2)], [group], [1], [Route([0], input=0)]).image()
    assert NativeChip(image, 0).join(np.zeros(1), Decoder(image, []).table, np.zeros(0)) is None
