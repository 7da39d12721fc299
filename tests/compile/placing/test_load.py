import pytest
from images import Block, Group, Parts
from packing_problems import ROOM

from spikeport.compile.placing.load import Capacity, Load, ProfileMasks


def test_loads_add_up_and_share_profiles() -> None:
    first = Load((1, 2, 3, 4), (0b01, 0b11, 0, 1, 0, 0))
    second = Load((4, 3, 2, 1), (0b01, 0b01, 0b10, 1, 0, 0))
    assert first.joined(second) == Load((5, 5, 5, 5), (0b01, 0b11, 0b10, 1, 0, 0))


@pytest.mark.parametrize(
    ("load", "share"),
    [
        (Load((3, 5, 0, 0)), 0.5),
        (Load((3, 0, 0, 0), (0b11, 0, 0, 0, 0, 0)), 1.0),
        (Load((3, 0, 0, 0), (0, 0, 0, 1, 1, 1)), 0.3),  # a core has one of each of these
    ],
)
def test_a_load_fills_a_core_by_its_scarcest_resource(load: Load, share: float) -> None:
    assert ROOM.fill(load) == share


def test_shares_of_a_core_have_all_its_profiles() -> None:
    assert ROOM.shared(4) == Capacity((2.5,) * 4, ROOM.profiles)


def test_profiles_are_of_stretches_and_of_the_groups_that_reach_them() -> None:
    blocks = [Block(3, vth=[64, 128, 64], enable_noise=[0, 0, 1]), Block(1, vth=192)]
    learning = (1, 0, 0, 2, 8, 1, 1)
    image = Parts(blocks, [Group([[64]]), Group([[64]], learning=learning)]).image()
    masks = ProfileMasks(image)
    assert [masks.of(0, *ends, [])[1] for ends in ((0, 1), (0, 2), (2, None))] == [1, 3, 1]
    assert [masks.of(0, *ends, [])[4] for ends in ((0, 2), (2, 3))] == [0, 1]
    assert [masks.of(0, 0, 3, groups)[5] for groups in ([], [0], [1], [0, 1])] == [0, 1, 2, 3]
    assert [masks.of(0, 0, 3, groups)[2] for groups in ([], [0], [0, 1])] == [0, 1, 1]


def test_profiles_differ_where_any_of_their_settings_does() -> None:
    settings = [(0, 1), (1, 0), (1, 1), (0, 1)]
    pairs = [Block(1, decay_u=u, decay_v=v, vth=64 * (u + v)) for u, v in settings]
    masks = ProfileMasks(Parts(pairs).image())
    assert [masks.of(block, 0, 1, [])[0] for block in range(4)] == [1, 2, 4, 1]
