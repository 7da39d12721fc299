"""Flat arrays that spikes are delivered along."""

import itertools

import numpy as np
import pytest

from spikeport.backends.native import wiring
from spikeport.backends.native.wiring import LANES, Wiring, line_up, wire
from spikeport.errors import ImageError
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.two_blocks import two_blocks


@pytest.fixture
def nothing_is_short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wiring, "SHORT", 0)


@pytest.mark.usefixtures("nothing_is_short")
def test_each_source_has_its_deliveries() -> None:
    wired = wire(two_blocks())
    # sources: two compartments that send, three that do not, one on the host
    assert wired.delivery_start.tolist() == [0, 1, 2, 2, 2, 2, 3]
    first, second, host = wired.delivery.tolist()
    assert first != second == host
    runs = {
        delivery: wired.run[wired.run_start[delivery] : wired.run_start[delivery + 1]].tolist()
        for delivery in (first, second)
    }
    # first target, first weight, number of weights, shift beyond the common one
    ((target, place, size, shift),) = runs[first]
    assert (target, size, shift) == (2, 3, 0)
    weights = (wired.weights.astype(int) << wired.shift).tolist()
    assert weights[place : place + size] == [64, 128, 192]
    ((target, place, size, shift),) = runs[second]
    assert (target, size, shift) == (4, 1, 0)
    assert weights[place : place + size] == [320]
    assert (wired.shift, wired.weights.dtype) == (6, np.int8)


@pytest.mark.usefixtures("nothing_is_short")
def test_contacts_that_the_same_sources_reach_are_one_delivery() -> None:
    groups = [Group([[64, 128]]), Group([[192, 256]], block=1)]
    routes = [Route([0], group=0, input=0), Route([0], group=1, input=0)]
    wired = wire(Parts([Block(2), Block(2)], groups, [1], routes).image())
    assert wired.delivery.tolist() == [0]
    # the rows follow each other in targets and weights: one run of four
    assert wired.run.tolist() == [[0, 0, 4, 0]]
    assert wired.weights.tolist() == [1, 2, 3, 4]


def test_short_runs_are_lists_of_targets_and_values() -> None:
    """Short runs may lie between long ones, and keep the shift of their group."""
    groups = [
        Group([[64] * 9, [64, 128]], indices=[[range(9)], [[3, 7]]]),
        Group([[320, 448, 192]], block=1),
        Group([[256]], block=2),
    ]
    routes = [Route([0, 1], group=0, input=0), *(Route([0, 0], group=g, input=0) for g in (1, 2))]
    wired = wire(Parts([Block(9), Block(3), Block(3)], groups, [2], routes).image())
    assert wired.run[:, 2].tolist() == [9]
    lists = [
        list(zip(wired.target[a:b].tolist(), wired.value[a:b].tolist(), strict=True))
        for a, b in itertools.pairwise(wired.scattered_start.tolist())
    ]
    assert sorted(lists) == [[], [(3, 1), (7, 2)], [(9, 5), (10, 7), (11, 3), (12, 4)]]
    assert (wired.value.dtype, wired.shift) == (np.int16, 6)


def added(wired: Wiring) -> list[list[list[int]]]:
    """Return the targets and weights of each run that are not zero."""
    found = []
    for target, place, n, _ in wired.run.tolist():
        weights = wired.weights[place : place + n]
        used = np.flatnonzero(weights)
        found.append([(target + used).tolist(), weights[used].tolist()])
    return found


def test_runs_are_lined_up_in_whole_vectors() -> None:
    group = Group([[64] * 70, [64 * i for i in range(1, 41)]], axon_base=[3, 40])
    wired = wire(Parts([Block(80)], [group], [2], [Route([0, 1], input=0)]).image())
    lined_up = line_up(wired)
    assert added(lined_up) == added(wired)
    assert (lined_up.run[:, [0, 2]] % LANES == 0).all()
    assert sorted(lined_up.run[:, 2].tolist()) == [64, 96]
    assert lined_up.weights.ctypes.data % 64 == 0


def test_runs_that_share_weights_still_share_them_once_lined_up() -> None:
    group = Group([[64] * 40], axon_row=[0, 0, 0], axon_base=[9, 2, 30])
    wired = wire(Parts([Block(80)], [group], [3], [Route([0, 1, 2], input=0)]).image())
    lined_up = line_up(wired)
    assert added(lined_up) == added(wired)
    # in line with the lowest: the others begin as much before their targets as it does
    assert sorted(lined_up.run[:, 0].tolist()) == [0, 7, 28]
    assert len(lined_up.weights) == 64


def test_runs_are_not_lined_up_if_zeros_would_fill_the_memory() -> None:
    groups = [Group([[64] * 9] * 20, axon_base=[28] * 20)]
    wired = wire(Parts([Block(40)], groups, [20], [Route(range(20), input=0)]).image())
    assert line_up(wired) is wired


def test_runs_of_a_group_that_learns_are_not_scattered() -> None:
    group = Group([[0, 0]], learning=(1, 4, -7, 10, 8.5, 2, 4))
    wired = wire(Parts([Block(2)], [group], [1], [Route([0], input=0)]).image())
    assert (len(wired.run), len(wired.target)) == (1, 0)


@pytest.mark.parametrize(("largest", "dtype"), [(127, np.int8), (128, np.int16), (2**15, np.int32)])
def test_weights_have_the_narrowest_type_that_holds_them(largest: int, dtype: type) -> None:
    image = Parts([Block(2)], [Group([[1, largest]])], [1], [Route([0], input=0)]).image()
    assert wire(image).weights.dtype == dtype


def test_a_spike_costs_the_synapses_that_it_reads_on_each_core() -> None:
    wired = wire(two_blocks())
    costs = [
        wired.cost[wired.fan_start[fan] : wired.fan_start[fan + 1]].tolist() for fan in wired.fan
    ]
    # core, synapses read there, core of the source: the host has none
    assert costs == [[[1, 3, 0]], [[1, 1, 0]], [], [], [], [[1, 1, -1]]]


def test_an_axon_without_a_base_costs_a_message_and_delivers_nothing() -> None:
    group = Group([[64, 64]], axon_base=[-1])
    wired = wire(Parts([Block(2)], [group], [1], [Route([0], input=0)]).image())
    assert wired.delivery.tolist() == []
    assert wired.cost.tolist() == [[0, 0, -1]]


def test_rows_that_too_many_axons_share_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(wiring, "MOST_PARTS", 3)
    monkeypatch.setattr(wiring, "MOST_SHARED", 0)
    group = Group([[64]], axon_row=[0, 0])
    with pytest.raises(ImageError) as caught:
        wire(Parts([Block()], [group]).image())  # a run and an atom for each of two axons
    assert str(caught.value).startswith("its axons read 4 runs of weights, limit 3 for an image of")
