"""The recorder of a host's spikes in front of a chip."""

import numpy as np

from spikeport.backends.recorder import Recorder


class Chip:
    """A chip that notes calls, and answers with the number of spikes."""

    def __init__(self):
        self.errors, self.closed = [], False

    def step(self, spikes, errors):
        self.errors.append(errors)
        return [np.array([len(spikes)])]

    def activity(self):
        return "counts"

    def close(self):
        self.closed = True


def test_spikes_are_recorded_as_sent_and_the_chip_steps():
    chip, spikes = Chip(), np.array([1, 4], dtype=np.uint8)
    recorder = Recorder(chip)
    assert recorder.step(spikes, {2: "error"})[0].tolist() == [2]
    spikes[:] = 0
    recorder.step(np.zeros(0, dtype=int), {})
    assert [one.tolist() for one in recorder.spikes] == [[1, 4], []]
    assert chip.errors == [{2: "error"}, {}]


def test_activity_and_closing_are_passed_on_to_the_chip():
    chip = Chip()
    recorder = Recorder(chip)
    assert recorder.activity() == "counts"
    recorder.close()
    assert chip.closed
