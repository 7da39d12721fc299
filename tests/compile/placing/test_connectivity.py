"""The wiring of an image, divided and put together again."""

import numpy as np
import pytest
from hypothesis import given

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.placing.connectivity import (
    SpikeRows,
    assemble,
    division_of,
    groups_of,
    routes_of,
)
from tests.helpers.images import images
from tests.helpers.two_blocks import two_blocks


@pytest.mark.slow
@given(images())
def test_an_image_that_is_divided_and_assembled_again_is_unchanged(image: ChipImage) -> None:
    assert assemble(image, division_of(image), groups_of(image), routes_of(image)) == image


def test_a_group_has_its_rows_and_axons() -> None:
    (group,) = groups_of(two_blocks())
    assert (group.like, group.block) == (0, 1)
    assert (group.rows.atoms.tolist(), group.rows.start.tolist()) == ([1, 1], [0, 3, 4])
    assert group.rows.weights.tolist() == [64, 128, 192, 320]
    assert group.rows.indices.tolist() == [0, 1, 2, 2]
    assert (group.axon_row.tolist(), group.axon_base.tolist()) == ([0, 1], [0, 0])


def test_routes_come_from_blocks_and_from_the_host() -> None:
    found = [
        (route.of_input, route.source, route.group, route.axon.tolist(), route.atom.tolist())
        for route in routes_of(two_blocks())
    ]
    assert found == [(False, 0, 0, [0, 1], [0, 0]), (True, 0, 0, [1], [0])]


def test_an_image_can_be_assembled_with_other_groups_and_routes() -> None:
    image = two_blocks()
    (group,) = groups_of(image)
    rows, atom = group.rows, np.array([1])
    halves = [
        group._replace(
            rows=SpikeRows(
                atom, np.array([0, end - begin]), rows.weights[begin:end], rows.indices[begin:end]
            ),
            axon_row=np.array([0]),
            axon_base=np.array([0]),
        )
        for begin, end in ((0, 3), (3, 4))
    ]
    first, host = routes_of(image)
    routes = [
        first._replace(group=0, axon=np.array([0, -1])),
        first._replace(group=1, axon=np.array([-1, 0])),
        host._replace(group=1, axon=np.array([0])),
    ]
    after = assemble(image, division_of(image), halves, routes)
    assert after.groups.block.tolist() == [1, 1]
    assert after.groups.axon_start.tolist() == [0, 1, 2]
    assert after.groups.row_start.tolist() == [0, 1, 2]
    assert after.synapses.weight.tolist() == [64, 128, 192, 320]
    assert after.routes.group.tolist() == [0, 1, 1]
    assert after.out_axons.axon.tolist() == [0, -1, -1, 0, 0]
    assert [entry.label for entry in after.manifest.groups] == ["group 0", "group 0"]
    assert after.inputs is image.inputs
