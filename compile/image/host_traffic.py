"""The traffic of an image with its host: spikes and learning errors in, values and spikes back.

Outputs are packed as by nengo-loihi's snips. Each chip sends a word with the number of the step,
even if nothing on the chip is read, a word for each current and voltage that is read, and a word
for 32 spikes of evenly spaced compartments.

Source: nengo-loihi 1.1.0, hardware/interface.py, ``Snips.__init__`` and
``ChipSnips.prepare_for_probe``.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import Encoding
from spikeport.compile.image.tables import offsets, parts
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.host_io import HostTraffic
from spikeport.hardware_models.topology import chip_of, chips_used

SPIKED = "spiked"
"""The state of a compartment that is a bit; its other states are values."""
SPIKES_A_WORD = 32


def host_traffic(image: ChipImage, chip: ChipModel) -> HostTraffic:
    """Return the traffic between host and chips in a step."""
    entries, dt_s = image.manifest.inputs, image.manifest.dt_s
    read = list(_segments(image))
    return HostTraffic(
        dt_s=dt_s,
        sources=image.n_inputs,
        spikes=sum(e.size * mean_rate_hz(e.encoding, dt_s) for e in entries) * dt_s,
        unknown_sources=int(image.sends_spikes.sum()),
        values_back=sum(len(segment) for key, segment in read if key != SPIKED),
        spikes_back=sum(len(segment) for key, segment in read if key == SPIKED),
        words_back=_words_back(image, chip, read),
        errors=_errors(image),
    )


def mean_rate_hz(encoding: Encoding, dt_s: float) -> float:
    r"""Return the mean rate, in Hz, of a source that encodes values spread evenly from -1 to 1.

    .. math:: r = \frac{1}{2} \int_{-1}^{1} \min(\max(gain\, x + bias, 0), 1 / dt)\, dx

    The rate of spikes that are sent as they come is not known, and counts as 0.
    """
    if encoding.kind == "spikes":
        return 0.0
    most, low, high = 1 / dt_s, encoding.bias - encoding.gain, encoding.bias + encoding.gain
    if low == high:
        return float(np.clip(low, 0, most))
    below = np.clip([low, high], 0, most) ** 2 / 2  # the integral from 0 to either end
    above = most * np.maximum(np.array([low, high]) - most, 0)
    return float(np.diff(below + above)[0] / (high - low))


def _segments(image: ChipImage) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the state and the compartments, (n,), that are read of each block."""
    for number, entry in enumerate(image.manifest.outputs):
        for segment in parts(offsets(entry.segments), image.read_by(number)):
            # A segment is of a block as it was built, whose pieces may lie on several cores.
            block = image.compartment_block[segment]
            for piece in np.unique(block):
                yield entry.key, segment[block == piece]


def _words_back(
    image: ChipImage, chip: ChipModel, read: Sequence[tuple[str, np.ndarray]]
) -> tuple[int, ...]:
    """Return the words that each chip sends; none if nothing crosses: the host need not wait."""
    if not (read or image.n_inputs or _errors(image)):
        return ()
    numbers, words = chip_of(image.n_cores, chip), [1] * chips_used(image.n_cores, chip)
    for key, compartments in read:
        core = image.blocks.core[image.compartment_block[compartments[0]]]
        words[numbers[core]] += _words(compartments) if key == SPIKED else len(compartments)
    return tuple(words)


def _words(compartments: np.ndarray) -> int:
    """Return the number of words for the spikes of some compartments of a block."""
    steps = np.diff(compartments)
    even = len(steps) > 0 and bool(np.all(steps == steps[0]))
    return -(-len(compartments) // SPIKES_A_WORD) if even else len(compartments)


def _errors(image: ChipImage) -> int:
    """Return the number of learning errors: one for every two compartments of a learning block."""
    learning = np.unique(image.groups.block[image.learns])
    return int(np.diff(image.blocks.start)[learning].sum()) // 2
