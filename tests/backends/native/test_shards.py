"""A chip with its cores divided among threads, against a chip on one thread, bit for bit."""

import os
import signal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spikeport.backends.native.chip import NativeChip
from spikeport.backends.native.shards import divided
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from tests.helpers.images import Block, Group, Parts, Route, images
from tests.helpers.side_by_side import assert_equal_activity, random_spikes, snapshot


def assert_equal_threads(image: ChipImage, seed: int, steps: list[np.ndarray], n: int) -> None:
    one, many = NativeChip(image, seed), NativeChip(image, seed, threads=n)
    for spikes in steps:
        for ours, theirs in zip(one.step(spikes, {}), many.step(spikes, {}), strict=True):
            np.testing.assert_array_equal(ours, theirs)
        for ours, theirs in zip(snapshot(one), snapshot(many), strict=True):
            np.testing.assert_array_equal(ours, theirs)
    assert_equal_activity(one, many)
    many.close()


@pytest.mark.slow
@settings(max_examples=100)
@given(image=images(), seed=st.integers(0, 2**32 - 1), n=st.integers(2, 4))
def test_any_image_has_equal_state_outputs_and_counts(image: ChipImage, seed: int, n: int) -> None:
    assert_equal_threads(image, seed, random_spikes(image, 20, seed), n)


def ring(n_cores: int, **options: object) -> ChipImage:
    """Return blocks of 40 on a core each, wired to the next; the host drives the first."""
    blocks = [Block(40, core, bias=90, vth=640) for core in range(n_cores)]
    weights = np.full((40, 40), 64)
    groups = [Group(list(weights[:, np.newaxis]), block=core, **options) for core in range(n_cores)]
    axons = np.arange(40)
    routes = [Route(axons, group=core, block=core - 1) for core in range(1, n_cores)]
    return Parts(blocks, groups, [40], [*routes, Route(axons, group=0, input=0)]).image()


def test_the_host_may_send_more_spikes_in_a_step_than_there_are_sources() -> None:
    image = ring(4)
    often = np.repeat(np.arange(40), 20)
    assert_equal_threads(image, 0, [often, often, np.arange(40)] * 3, n=2)


def test_cores_with_equal_work_are_divided_evenly() -> None:
    assert [mine.tolist() for mine in divided(ring(8), 2)] == [[0, 1, 2, 3], [4, 5, 6, 7]]
    assert [mine.tolist() for mine in divided(ring(3), 8)] == [[0], [1], [2]]


def test_cores_are_divided_by_their_compartments() -> None:
    image = Parts([Block(n, core) for core, n in enumerate((10, 10, 30, 10, 20))]).image()
    assert [mine.tolist() for mine in divided(image, 2)] == [[0, 1, 2], [3, 4]]
    assert [mine.tolist() for mine in divided(image, 3)] == [[0, 1], [2], [3, 4]]


def test_spikes_of_no_source_are_refused() -> None:
    chip = NativeChip(ring(2), 0, threads=2)
    with pytest.raises(BackendError, match="the host sent 1 spikes of sources 40 to 40, but "):
        chip.step(np.array([40]), {})
    chip.close()


def test_an_image_that_learns_runs_on_one_thread() -> None:
    learning = Group(weights=[[0, 0]], learning=(1, 4, -7, 10, 8.5, 2, 4))
    image = Parts([Block(2, 0), Block(2, 1)], [learning]).image()
    assert NativeChip(image, 0, threads=2)._threads is None


def test_a_forked_process_has_threads_of_its_own() -> None:
    chip, twin = (NativeChip(ring(4), 0, threads=2) for _ in range(2))
    spikes = np.arange(40)
    for one in (chip, twin):
        one.step(spikes, {})
    child = os.fork()
    if child == 0:
        signal.alarm(20)  # without threads of its own, the child would wait forever
        chip.step(spikes, {})
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    for one in (chip, twin):
        one.close()
