"""The check of an image against itself, written to registers and read back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, event, given, settings

from spikeport.backends.board.nxsdk import check as module
from spikeport.backends.board.nxsdk.check import check, quiet
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network
from spikeport.find_network import find_network
from tests.helpers.images import Block, Group, Output, Parts, Route
from tests.helpers.two_blocks import two_blocks
from tests.helpers.writable import writable, writable_images


@pytest.mark.slow
@settings(max_examples=25)
@given(image=writable_images())
def test_registers_of_any_image_that_is_not_refused_run_like_it(image: ChipImage) -> None:
    for placement in (Placement.single(image), Placement.packed(image)):
        checked = check(image, placement, 20)
        event(f"{placement.name}: {'refused' if checked.refused else 'written'}")
        assume(not checked.refused)  # Hypothesis fails if most images are refused
        assert checked.equal, checked


def test_the_check_counts_cores_synapses_and_steps() -> None:
    image = writable(two_blocks())
    checked = check(image, Placement.single(image), 7)
    assert (checked.n_cores, checked.n_synapses, checked.n_steps) == (2, 4, 7)
    assert checked.equal
    assert checked.differing == {"u": 0, "v": 0, "spiked": 0, "noise": 0, "learning": 0}


def test_a_threshold_between_two_mantissas_is_found() -> None:
    image = Parts([Block(1, bias=1, vth=100)]).image()  # registers hold multiples of 64
    checked = check(image, Placement.single(image), 150)
    assert checked.differing["spiked"] > 0
    assert checked.differing["v"] > 0
    assert not checked.equal


def test_noise_that_is_read_back_differently_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    image = Parts([Block(3, enable_noise=[0, 1, 1], noise_exp=9, vth=64)]).image()
    assert check(image, Placement.single(image), 1).differing["noise"] == 0
    wrong = image.blocks.noise_exp + 1
    decompile = module.decompile

    def other(*args: object) -> ChipImage:
        back = decompile(*args)  # type: ignore[arg-type]
        return replace(back, blocks=replace(back.blocks, noise_exp=wrong))

    monkeypatch.setattr(module, "decompile", other)
    assert check(image, Placement.single(image), 1).differing["noise"] == 2


def test_a_phantom_spike_is_counted() -> None:
    # The voltage grows by 64 a step, and is 128, as in a spike, in every other step.
    block = Block(1, bias=64, vth=192, refract_delay=1)
    image = Parts([block], outputs=[Output("spiked", [0])]).image()
    checked = check(image, Placement.single(image), 4)
    assert (checked.n_spike_values, checked.n_phantoms, checked.n_spikes) == (4, 1, 1)


def test_an_input_that_reaches_nothing_is_written() -> None:
    routes = [Route([0, 0], input=1)]
    image = writable(Parts([Block(2)], [Group([[64, 64]])], [3, 2], routes).image())
    checked = check(image, Placement.single(image), 5)
    assert checked.equal
    assert checked.n_registers > 0


def test_a_refused_placement_is_not_written() -> None:
    group = Group([[64]], pop_type=32)
    routes = [Route([0], block=0), Route([0], input=0)]
    image = Parts([Block(1), Block(1)], [group], [1], routes).image()
    checked = check(image, Placement.packed(image), 5)
    assert checked.refused
    assert not checked.equal
    assert checked.n_registers == 0


def test_a_quiet_image_has_neither_noise_nor_learning() -> None:
    image = Parts([Block(2, enable_noise=1)], [Group([[64]], learning=(1,) * 7)]).image()
    still = quiet(image)
    assert not still.compartments.enable_noise.any()
    assert not still.learns.any()
    assert np.array_equal(still.synapses.weight, image.synapses.weight)


@pytest.mark.slow
def test_the_arm_runs_from_registers_alone() -> None:
    image = compile_network(find_network("arm", ["m1=300"])).image
    single = check(image, Placement.single(image), 100)
    packed = check(image, Placement.packed(image), 100)
    assert (single.n_cores, packed.n_cores) == (image.n_blocks, image.n_cores) == (26, 4)
    assert single.equal
    assert packed.equal
    assert single.n_synapses == len(image.synapses)
    assert single.n_spikes == packed.n_spikes > 10_000
    assert [one.trap.id for one in single.findings] == ["NX08", "NX09", "NX14"]
    assert [one.trap.id for one in packed.findings] == ["NX01", "NX08", "NX09", "NX10", "NX14"]
