"""The refractory time that the register V counts down after a spike."""

import numpy as np

from spikeport.backends.board.nxsdk.voltage_register import refractory_left
from spikeport.backends.native.chip import NativeChip
from tests.helpers.images import Block, Parts


def test_the_whole_refractory_time_is_left_in_the_step_of_a_spike() -> None:
    refract = np.array([3, 1])
    image = Parts([Block(2, bias=[100, 1], vth=[50, 1000], refract_delay=refract)]).image()
    chip, left = NativeChip(image, seed=0), []
    for _ in range(4):
        chip.step(np.zeros(0, dtype=int), {})
        left.append(refractory_left(chip.state, refract).tolist())
    assert left == [[3, 0], [1, 0], [0, 0], [3, 0]]
