"""Blocks in floating point, against values computed by hand step by step."""

import numpy as np
import pytest

from spikeport.backends.float_chip import FloatChip
from spikeport.compile.loihi.numbers import Numbers
from tests.helpers.images import Block, Group, Parts, Route


def numbers(n: int, weights: list[float], **given: object) -> Numbers:
    """Return neurons without a leak, with a threshold of 1."""
    values = {
        "bias": 0.0,
        "vth": 1.0,
        "decay_u": 1.0,
        "decay_v": 0.0,
        "scale_u": False,
        "scale_v": False,
        "vmin": -10.0,
        "vmax": 10.0,
        "to_integers": 1.0,
    } | given
    constants = {name: np.broadcast_to(value, n) for name, value in values.items()}
    return Numbers(weights=np.array(weights), **constants)


def silent(n_steps: int) -> list[np.ndarray]:
    return [np.zeros(0, dtype=int)] * n_steps


def voltages(chip: FloatChip, given: Numbers, spikes: list[np.ndarray]) -> list[float]:
    return [float(voltage[0]) for voltage, _ in chip.run(given, spikes)]


def test_a_neuron_above_threshold_spikes_and_is_then_refractory() -> None:
    chip = FloatChip(Parts([Block(1, refract_delay=2)]).image())
    states = list(chip.run(numbers(1, [], bias=0.375), silent(8)))
    spiked = [bool(spiked[0]) for _, spiked in states]
    assert [voltage[0] for voltage, _ in states] == [0.375, 0.75, 0, 0, 0.375, 0.75, 0, 0]
    assert spiked == [False, False, True, False, False, False, True, False]


def test_voltage_and_current_leak_and_the_input_is_scaled_where_a_block_says_so() -> None:
    chip = FloatChip(Parts([Block(1)], [Group([[64]])], [1], [Route([0], input=0)]).image())
    spikes = [np.array([0]), *silent(3)]
    leaky = {"decay_u": 0.5, "decay_v": 0.25, "vth": 9.0}
    # a spike of the host arrives one step later; currents are 0.8, 0.4, 0.2
    assert voltages(chip, numbers(1, [0.8], **leaky), spikes) == pytest.approx(
        [0, 0.8, 0.75 * 0.8 + 0.4, 0.75 * 1.0 + 0.2]
    )
    scaled = numbers(1, [0.8], **leaky, scale_u=True, scale_v=True)
    assert voltages(chip, scaled, spikes) == pytest.approx(
        [0, 0.1, 0.075 + 0.05, 0.75 * 0.125 + 0.025]
    )


def test_voltages_are_clipped() -> None:
    chip = FloatChip(Parts([Block(1)]).image())
    given = numbers(1, [], bias=-0.75, vmin=-1.0)
    assert voltages(chip, given, silent(3)) == [-0.75, -1.0, -1.0]


def test_spikes_of_neurons_arrive_one_step_later() -> None:
    image = Parts([Block(2)], [Group([[64]], [[[1]]])], routes=[Route([0, -1], block=0)]).image()
    given = numbers(2, [0.3], bias=np.array([2.0, 0.0]))
    states = [voltage.tolist() for voltage, _ in FloatChip(image).run(given, silent(3))]
    assert states == [[0, 0], [0, 0.3], [0, 0.6]]
