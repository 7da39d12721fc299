"""The walk over the deliveries of an image, against a walk by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given

from spikeport.compile.image import deliveries as module
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import (
    deliveries,
    row_lengths,
    sums_by_target,
    synapses_of,
    targets_of,
)
from spikeport.compile.image.fanout import fanout
from spikeport.compile.image.tables import part
from spikeport.compile.image.traffic import reached_blocks
from tests.helpers.images import Block, Group, Parts, Route, images


def by_hand(image: ChipImage) -> list[tuple[int, int, int, int, int, int]]:
    """Return (source, route, group, axon, row, atom) of every delivery, found by loops."""
    found = []
    first_input = image.n_compartments + np.concatenate([[0], np.cumsum(image.inputs.size)])
    for route in range(len(image.routes)):
        number, group = int(image.routes.source[route]), int(image.routes.group[route])
        starts = first_input if image.routes.from_input[route] else image.blocks.start
        mine = part(image.routes.start, route)
        for i, place in enumerate(range(mine.start, mine.stop)):
            axon = int(image.out_axons.axon[place])
            if axon >= 0:
                axon += int(image.groups.axon_start[group])
                row = int(image.groups.row_start[group] + image.in_axons.row[axon])
                atom = int(image.out_axons.atom[place])
                found.append((int(starts[number]) + i, route, group, axon, row, atom))
    return found


@pytest.mark.slow
@given(images())
def test_every_delivery_is_found_once(image: ChipImage) -> None:
    ways = deliveries(image)
    assert list(zip(*(array.tolist() for array in ways), strict=True)) == by_hand(image)


@pytest.mark.slow
@given(images())
def test_fanout_reached_blocks_and_synapses_agree_with_a_walk_by_hand(image: ChipImage) -> None:
    operations = np.zeros((image.n_sources, image.n_cores), dtype=int)
    reached = np.zeros((image.n_sources, image.n_blocks), dtype=int)
    for source, _, group, axon, row, _ in by_hand(image):
        block = image.groups.block[group]
        reached[source, block] = 1
        if image.in_axons.base[axon] >= 0:
            length = np.diff(image.rows.start)[row] // image.rows.atoms[row]
            operations[source, image.blocks.core[block]] += length
    found = fanout(image)
    assert np.array_equal(found.synaptic_operations, operations)
    assert np.array_equal(reached_blocks(image).toarray(), reached)
    assert sum(len(synapses.source) for synapses in synapses_of(image)) == operations.sum()
    assert (row_lengths(image) * image.rows.atoms).sum() == len(image.synapses)


@given(images())
def test_synapses_lead_into_the_block_of_their_group(image: ChipImage) -> None:
    for route, synapses in enumerate(synapses_of(image)):
        block = image.groups.block[image.routes.group[route]]
        assert (image.compartment_block[synapses.target] == block).all()


@pytest.mark.slow
@given(images())
def test_sums_by_target_add_the_weight_of_every_synapse_times_its_sources_value(
    image: ChipImage,
) -> None:
    weights = np.arange(1.0, 1 + len(image.synapses))
    values = np.stack([3.0 ** np.arange(image.n_sources) % 97, np.arange(image.n_sources)])
    sums = np.zeros((2, image.n_compartments))
    for synapses in synapses_of(image):
        for total, value in zip(sums, values, strict=True):
            np.add.at(total, synapses.target, weights[synapses.number] * value[synapses.source])
    assert np.array_equal(sums_by_target(image, weights, values), sums)


@pytest.mark.slow
@given(images())
def test_targets_are_those_of_every_synapse_of_some_sources(image: ChipImage) -> None:
    sources = np.arange(image.n_sources) % 3 == 0
    found = [one.target[sources[one.source]] for one in synapses_of(image)]
    targets = np.isin(np.arange(image.n_compartments), np.concatenate([*found, []]))
    assert np.array_equal(targets_of(image, sources), targets)


def test_the_cost_of_sums_grows_with_paths_and_synapses_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    n = 100
    groups = [Group([[64]], block=block) for block in range(1, n)]
    routes = [Route([0], group=group, block=0) for group in range(n - 1)]
    image = Parts([Block(1) for _ in range(n)], groups, routes=routes).image()
    sizes: list[int] = []
    add = np.add.at

    def added(total: np.ndarray, index: np.ndarray, values: np.ndarray) -> None:
        sizes.append(len(index))
        add(total, index, values)

    numpy = SimpleNamespace(**{**vars(np), "add": SimpleNamespace(at=added)})
    monkeypatch.setattr(module, "np", numpy)
    sums_by_target(image, np.ones(n - 1), np.ones((1, n)))
    assert sum(sizes) == 2 * (n - 1)
