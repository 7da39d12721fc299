"""The Verilog against the native chip: every state of every compartment after every step."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import spikeport.backends.softcore.chip as softcore_chip
from spikeport.backends.board.board import Board, Machine
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.softcore.chip import RtlChip, SoftChip
from spikeport.backends.softcore.simulation import STATE, Simulation
from spikeport.backends.softcore.writer import written
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.fake_board import FakeClock, FakeLine, small_image, spike_train
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.side_by_side import random_spikes
from tests.helpers.soft_images import BUILD, soft_images, wide_image
from tests.helpers.softcore_integers import decoded

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("verilator") is None, reason="no verilator: make referees"),
]


def assert_same(image: ChipImage, steps: list[np.ndarray]) -> RtlChip:
    """Compare all states and outputs of all steps with the native chip's."""
    chip, native = RtlChip(image, 0, build=BUILD), NativeChip(image, 0)
    for spikes in steps:
        outputs = zip(chip.step(spikes, {}), native.step(spikes, {}), strict=True)
        for found, expected in outputs:
            np.testing.assert_array_equal(found, expected)
        assert chip.differing == {}
    chip.close()
    return chip


@settings(max_examples=10)
@given(image=soft_images(), seed=st.integers(0, 2**32 - 1))
def test_any_image_has_the_native_states(image: ChipImage, seed: int) -> None:
    assert_same(image, random_spikes(image, 20, seed))


@settings(max_examples=5)
@given(image=soft_images(), seed=st.integers(0, 2**32 - 1))
def test_a_step_counts_the_messages_and_weights_of_its_spikes(image: ChipImage, seed: int) -> None:
    memory = written(image, BUILD.unit, BUILD.cores)
    simulation, lists, n = Simulation(memory, BUILD), memory.messages_by_source(), len(memory.order)
    for spikes in random_spikes(image, 20, seed):
        stepped = simulation.step(memory.messages(spikes))
        fired = memory.order[simulation.state[:, STATE.index("spiked")] != 0]
        sent = [one for source in [*fired, *(n + spikes)] for one in lists[source]]
        weights = np.zeros(len(memory.cores), dtype=int)
        for core, row in sent:
            weights[core] += len(decoded(memory.cores[core].rows, row, memory.unit)[0])
        assert stepped.messages == len(sent)
        np.testing.assert_array_equal(stepped.weights, weights)
    simulation.close()


def test_an_image_of_wide_rows_and_full_queues_has_the_native_states() -> None:
    """Nine sources of the host spike at once, each to three blocks, into queues of four."""
    image = wide_image(2)
    steps = [np.repeat(np.arange(9), 3)] * 10 + random_spikes(image, 30, 1)
    chip = assert_same(image, steps)
    assert chip.worst_cycles > 3000


def test_a_session_reports_the_states_that_it_compared() -> None:
    printed: list[str] = []
    machine = Machine("rtl", lambda image, seed: RtlChip(image, seed, printed.append, BUILD))
    clock, native = FakeClock(), NativeChip(small_image(), 0)
    chip = BoardChip(small_image(), 0, FakeLine(Board(machine), clock, ()), clock=clock)
    for spikes in spike_train(200):
        for found, expected in zip(chip.step(spikes, {}), native.step(spikes, {}), strict=True):
            np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(chip.activity().messages, native.activity().messages)
    chip.close()
    nothing = "u 0, v 0, q 0, refractory 0, spiked 0"
    assert printed[2] == f"5,000 states compared in 200 steps; differing: {nothing}"
    assert printed[3].startswith("cycles a step: ")


def test_a_bus_that_all_cores_wait_for_is_expected() -> None:
    """Each of 600 compartments spikes in every step, to all six cores: 3,600 messages."""
    n, cores, printed = 100, range(6), list[str]()
    blocks = [Block(n=n, core=core, bias=1000, vth=10, refract_delay=0) for core in cores]
    groups = [Group([[64]], block=block) for block in cores]
    routes = [Route([0] * n, group=group, block=block) for group in cores for block in cores]
    chip = RtlChip(Parts(blocks, groups, [1], routes).image(), 0, printed.append, BUILD)
    for _ in range(3):
        chip.step(np.zeros(0, dtype=int), {})
    chip.close()
    assert "10,821 in the longest" in printed[-1]
    assert printed[-1].endswith(f"and {3 * 3600 + 24:,}")


class Wrong(SoftChip):
    """A chip whose outputs are wrong from the third step on."""

    compared: ClassVar = {"outputs": 6}

    def _advance(
        self, messages: np.ndarray, expected: list[np.ndarray]
    ) -> tuple[int, list[np.ndarray]]:
        right = np.concatenate(expected)
        self._compare("outputs", right + (self.n_steps >= 2), right)
        return 7, expected

    def _free(self) -> None:
        pass


def test_the_first_step_that_differs_is_reported_at_once_and_the_chip_at_the_end() -> None:
    printed: list[str] = []
    image = small_image()
    image = replace(image, manifest=replace(image.manifest, chip="softcore-up5k"))
    chip = Wrong(image, 0, written(image), printed.append)
    for _ in range(4):
        chip.step(np.array([0]), {})
    assert printed == ["step 3 is the first that differs: 6 outputs"]
    chip.close()
    assert printed[1] == "24 states compared in 4 steps; differing: outputs 12"
    assert "expected for softcore-up5k: " in printed[2]


@pytest.fixture
def simulation() -> Iterator[Simulation]:
    made = Simulation(written(small_image(), BUILD.unit, BUILD.cores), BUILD)
    yield made
    made.close()


def test_a_wrong_weight_in_the_memory_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[str] = []
    image, weights = small_image(), small_image().synapses.weight.copy()
    weights[2] += 64  # the first source's weight into the third compartment
    wrong = replace(image, synapses=replace(image.synapses, weight=weights))
    monkeypatch.setattr(softcore_chip, "written", lambda _, *chip: written(wrong, *chip))
    chip = RtlChip(image, 0, printed.append, BUILD)
    chip.step(np.array([0, 1]), {})
    assert chip.differing == {}  # its spikes arrive in the next step
    chip.step(np.array([], dtype=int), {})
    chip.close()
    assert chip.differing == {"u": 1, "v": 1, "q": 1}
    assert printed[0] == "step 2 is the first that differs: 1 u"


def test_a_step_without_messages_takes_as_long_as_its_largest_core(simulation: Simulation) -> None:
    assert simulation.step(np.zeros((0, 2))).cycles < 3 + 20
