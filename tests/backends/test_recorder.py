"""A recorder of a host's spikes before a chip."""

import numpy as np

from spikeport.backends.recorder import Recorder


class Chip:
    """Chip that notes what is done with it, and answers with the number of spikes."""

    def __init__(self):
        self.errors, self.closed = [], False

    def step(self, spikes, errors):
        self.errors.append(errors)
        return [np.array([len(spikes)])]

    def activity(self):
        return "counts"

    def close(self):
        self.closed = True


def test_spikes_are_kept_as_they_were_and_the_chip_steps():
    chip, spikes = Chip(), np.array([1, 4], dtype=np.uint8)
    recorder = Recorder(chip)
    assert recorder.step(spikes, {2: "error"})[0].tolist() == [2]
    spikes[:] = 0
    recorder.step(np.zeros(0, dtype=int), {})
    assert [one.tolist() for one in recorder.spikes] == [[1, 4], []]
    assert chip.errors == [{2: "error"}, {}]


def test_all_else_is_the_chips():
    chip = Chip()
    recorder = Recorder(chip)
    assert recorder.activity() == "counts"
    recorder.close()
    assert chip.closed
