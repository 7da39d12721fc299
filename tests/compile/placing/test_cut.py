import numpy as np
from images import Block, Group, Parts, Route

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.placing.connectivity import groups_of, routes_of
from spikeport.compile.placing.cut import cut

Delivery = tuple[bool, int, int, int]
"""A spike's source, which is of an input or not, its target and its weight."""


def delivered(image: ChipImage) -> list[Delivery]:
    """Every synapse that a spike reaches, sorted; groups have rows of one atom, one input all."""
    groups, starts = groups_of(image), image.blocks.start
    found = []
    for route in routes_of(image):
        group, first = groups[route.group], 0 if route.of_input else int(starts[route.source])
        for source, axon in enumerate(route.axon.tolist(), start=first):
            if axon < 0 or group.axon_base[axon] < 0:
                continue
            row = group.rows[group.axon_row[axon]]
            targets = starts[group.block] + group.axon_base[axon] + row.indices[0]
            pairs = zip(targets.tolist(), row.weights[0].tolist(), strict=True)
            found += [(route.of_input, source, *pair) for pair in pairs]
    return sorted(found)


def image_of(group: Group, route: Route, n: int = 6) -> ChipImage:
    return Parts([Block(n)], [group], [len(route.axon)], [route]).image()


def test_rows_are_divided_where_their_targets_are() -> None:
    """Bases before a stretch, in it, and none."""
    group = Group([[64, 128, 192]], axon_row=[0] * 4, axon_base=[0, 2, 3, -1])
    image = image_of(group, Route([0, 1, 2, 3], input=0))
    after = cut(image, {0: [3, 5]})
    assert delivered(after) == delivered(image)
    assert [g.axon_base.tolist() for g in groups_of(after)] == [[0, 2], [0, 0], [0]]


def test_axons_that_shared_a_row_share_one_still() -> None:
    group = Group([[64] * 6, [128] * 6], axon_row=[0, 1, 0, 1])
    image = image_of(group, Route([0, 1, 2, 3], input=0))
    after = cut(image, {0: [3]})
    assert delivered(after) == delivered(image)
    assert [g.axon_row.tolist() for g in groups_of(after)] == [[0, 1, 0, 1]] * 2
    assert np.diff(after.groups.row_start).tolist() == [2, 2]


def test_pieces_that_nothing_reaches_have_no_groups_and_routes() -> None:
    image = image_of(Group([[64, 64]], axon_base=[4]), Route([-1, 0], input=0))
    after = cut(image, {0: [2, 4]})
    assert delivered(after) == delivered(image)
    assert [(g.block, len(g.rows)) for g in groups_of(after)] == [(2, 1)]
    assert [route.axon.tolist() for route in routes_of(after)] == [[-1, 0]]


def test_pieces_of_a_source_send_what_they_reach() -> None:
    group = Group([[64], [128]], axon_base=[0, 3], block=1)
    image = Parts([Block(4), Block(6)], [group], routes=[Route([0, -1, -1, 1], block=0)]).image()
    after = cut(image, {0: [2], 1: [3]})
    assert delivered(after) == delivered(image)
    ends = [(route.source, groups_of(after)[route.group].block) for route in routes_of(after)]
    assert ends == [(0, 2), (1, 3)]


def test_pieces_of_pieces_are_named_by_both_cuts() -> None:
    again = cut(cut(Parts([Block(6)]).image(), {0: [4]}), {0: [1]})
    assert [entry.cut for entry in again.manifest.blocks] == [
        ((0, 2), (0, 2)),
        ((0, 2), (1, 2)),
        ((1, 2),),
    ]
