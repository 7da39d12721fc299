"""PES learning, by nengo-loihi's own code: exact, and only learning synapses cost anything."""

from collections.abc import Mapping

import numpy as np

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)

# isort: split
from nengo_loihi.block import Axon
from nengo_loihi.emulator.interface import BlockInfo, SynapseState

from spikeport.backends.native.contacts import first_contacts
from spikeport.backends.native.rows import kept_synapses
from spikeport.backends.native.wiring import Wiring
from spikeport.backends.nengo_loihi import load_blocks
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.errors import BackendError, ImageError


class Learning:
    """Traces and weights of the learning synapse groups of an image.

    Parameters
    ----------
    image : ChipImage
        The image.
    wiring : Wiring
        Its wiring, whose weights follow those that are learned.
    rng : np.random.RandomState
        The chip's stream, shared with noise.

    Raises
    ------
    ImageError
        If axons of a learning group share a row, choose among atoms or are not used.
    """

    def __init__(self, image: ChipImage, wiring: Wiring, rng: np.random.RandomState) -> None:
        self._groups = np.flatnonzero(image.learns)
        for group in self._groups:
            _check_plain(image, int(group))
        blocks, synapses = load_blocks(image)
        for block in blocks:
            block.synapses = [s for s in block.synapses if s.learning]
        scale = image.manifest.pes_error_scale
        self._state = SynapseState(BlockInfo(blocks), pes_error_scale=scale, strict=False)
        self._synapses = {int(group): synapses[group] for group in self._groups}
        self._image, self._wiring, self._rng = image, wiring, rng
        self._cores = image.group_core
        deliveries = first_contacts(image)[image.groups.axon_start]  # one an axon: no atoms learn
        self._deliveries = {int(g): (deliveries[g], deliveries[g + 1]) for g in self._groups}
        self._places = {int(group): _places(image, int(group)) for group in self._groups}
        self._t = 0

    def check(self, errors: Mapping[int, np.ndarray]) -> None:
        """Refuse errors of groups that do not learn, or of another shape than the group's."""
        for group, error in errors.items():
            if group not in self._synapses:
                known = ", ".join(map(str, self._groups))
                raise BackendError(f"synapse group {group} does not learn; those that do: {known}")
            expected = self._state.pes_errors[self._synapses[group]].shape
            if np.shape(error) != expected:
                raise BackendError(
                    f"synapse group {group}: its error has shape {np.shape(error)}, not {expected}"
                )

    def step(self, touched: np.ndarray, errors: Mapping[int, np.ndarray]) -> np.ndarray:
        """Learn from the spikes and errors of a step; return the weights updated, (n_cores,)."""
        self._t += 1
        self._state.update_pes_errors([(self._synapses[g], self._t, e) for g, e in errors.items()])
        for group, synapse in self._synapses.items():
            first, end = self._deliveries[group]
            mine = touched[(touched >= first) & (touched < end)] - first
            self._state.spikes_in[synapse] = [Axon.Spike(axon) for axon in mine]
        self._state.update_traces(self._t, self._rng)
        self._state.update_weights(self._t, self._rng)
        return self._write_back()

    def _write_back(self) -> np.ndarray:
        updated = np.zeros(self._image.n_cores, dtype=np.int64)
        for group, synapse in self._synapses.items():
            if self._t % synapse.learn_epoch == 0:
                learned = np.concatenate([w.ravel() for w in synapse.weights])
                place, number = self._places[group]
                self._wiring.weights[place] = learned[number]
                updated[self._cores[group]] += synapse.size()
        return updated


def _check_plain(image: ChipImage, group: int) -> None:
    """Refuse axons that share rows: traces belong to axons, weights to rows, and they must meet."""
    axons, rows = part(image.groups.axon_start, group), part(image.groups.row_start, group)
    own = np.array_equal(image.in_axons.row[axons], np.arange(rows.stop - rows.start))
    if not own or (image.rows.atoms[rows] != 1).any() or (image.in_axons.base[axons] < 0).any():
        raise ImageError(
            f"synapse group '{image.manifest.groups[group].label}' learns: each of its "
            "axons needs a row of its own, of one atom, and a base; compile the image again"
        )


def _places(image: ChipImage, group: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of a group's weights in the wiring, and the numbers of those weights."""
    _, kept = kept_synapses(image)
    number = np.arange(len(image.synapses.weight))[kept]
    rows = part(image.groups.row_start, group)
    first, end = image.rows.start[[rows.start, rows.stop]]
    place = np.flatnonzero((number >= first) & (number < end))
    return place, number[place] - first
