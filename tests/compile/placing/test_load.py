"""Loads of blocks against what a core has."""

import math

import pytest

from spikeport.compile.placing.load import (
    Capacity,
    Load,
    ProfileMasks,
    block_loads,
    capacity,
    core_loads,
    together,
)
from spikeport.hardware_models import chip as chips
from tests.helpers.images import Block, Group, Parts
from tests.helpers.two_blocks import two_blocks

LOIHI = chips.get("loihi")
ROOM = Capacity((10, 20, 30, 40), (4, 2, 1, 1, 1, 1))


def test_amounts_add_up_and_profiles_unite() -> None:
    a = Load((1, 2, 3, 4), (0b01, 0b10, 0, 0b1, 0, 0))
    b = Load((5, 0, 0, 1), (0b11, 0b10, 0, 0b1, 0b100, 0))
    assert together([a, b]) == a.joined(b) == Load((6, 2, 3, 5), (0b11, 0b10, 0, 0b1, 0b100, 0))
    assert together([]) == Load()


@pytest.mark.parametrize("kind", range(4))
def test_a_core_holds_each_amount_up_to_its_limit(kind: int) -> None:
    def load(amount: int) -> Load:
        return Load(tuple(amount if k == kind else 0 for k in range(4)))

    most = int(ROOM.amounts[kind])
    assert ROOM.holds(load(most))
    assert not ROOM.holds(load(most + 1))


@pytest.mark.parametrize("kind", range(6))
def test_a_core_holds_distinct_profiles_up_to_its_limit(kind: int) -> None:
    def load(n: int) -> Load:
        return Load(profiles=tuple((1 << n) - 1 if k == kind else 0 for k in range(6)))

    most = int(ROOM.profiles[kind])
    assert ROOM.holds(load(most))
    assert not ROOM.holds(load(most + 1))


def test_a_share_of_a_core_has_all_of_its_profiles() -> None:
    assert ROOM.nth_part(4) == Capacity((2.5, 5, 7.5, 10), ROOM.profiles)


def test_the_scarcest_resource_decides_how_full_a_core_is() -> None:
    assert ROOM.fill(Load((5, 5, 5, 5))) == 0.5
    assert ROOM.fill(Load((5, 5, 27, 5))) == 0.9
    assert ROOM.fill(Load((5, 5, 5, 5), (0b111, 0, 0, 0, 0, 0))) == 0.75
    # settings of which a core has one do not count: every block takes one of each kind
    assert ROOM.fill(Load((5, 5, 5, 5), (0, 0, 0, 1, 1, 1))) == 0.5


def test_loihis_cores_have_the_limits_of_its_file() -> None:
    room = capacity(LOIHI)
    assert room.amounts == (1024, 4096, 4096, 128 * 8192)
    assert room.profiles == (32, 8, 8, 1, 1, 1)


def test_an_amount_that_is_not_public_has_no_limit() -> None:
    assert math.inf in capacity(chips.get("loihi2")).amounts


def test_the_load_of_a_block_is_counted_from_the_image() -> None:
    # these images store a synapse in a word of 64 bits
    sender, target = block_loads(two_blocks(), LOIHI)
    assert sender.amounts == (2, 0, 2, 0)
    assert target.amounts == (3, 2, 0, 4 * 64)
    assert sender.profiles == (0b1, 0b1, 0, 0b1, 0, 0)
    assert target.profiles == (0b1, 0b1, 0b1, 0b1, 0, 0b1)


def test_the_load_of_a_core_is_the_sum_of_its_blocks() -> None:
    parts = Parts([Block(2), Block(3, core=1), Block(5)])
    assert [load.amounts[0] for load in core_loads(parts.image(), LOIHI)] == [7, 3]


def test_each_distinct_setting_has_a_bit_of_its_own() -> None:
    blocks = [
        Block(3, vth=[64, 128, 64], decay_u=[1, 2, 2]),
        Block(1, vth=128, decay_u=1, vmax=511),
    ]
    masks = ProfileMasks(Parts(blocks, [Group([[64]], block=1)]).image())
    assert masks.of(0, 0, None, [])[:2] == (0b11, 0b11)
    assert masks.of(0, 1, 2, [])[:2] == (0b10, 0b10)
    assert masks.of(1, 0, None, [])[:2] == (0b01, 0b10)
    clipping = {masks.of(block, 0, None, [])[3] for block in (0, 1)}
    assert clipping == {0b01, 0b10}
    assert [group.tolist() for group in masks.groups] == [[], [0]]


def test_settings_of_noise_count_only_if_a_neuron_is_noisy() -> None:
    image = Parts([Block(2, enable_noise=[0, 1]), Block(1, noise_exp=3)]).image()
    masks = ProfileMasks(image)
    assert masks.of(0, 0, 1, [])[4] == 0
    assert masks.of(0, 0, None, [])[4].bit_count() == 1
    assert masks.of(1, 0, None, [])[4] == 0
