"""nengo-loihi's emulator, loaded from a chip image.

The emulator is used unchanged. Its blocks and inputs are rebuilt from the image alone, so that a
run cannot depend on anything that the image does not hold.
"""

import itertools
from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)

# isort: split
from nengo_loihi.block import Axon, LoihiBlock, Synapse, SynapseConfig
from nengo_loihi.emulator import EmulatorInterface
from nengo_loihi.inputs import SpikeInput

from spikeport.backends.chip import CLOSED
from spikeport.backends.counter import Counter
from spikeport.backends.host_checks import HostChecks
from spikeport.backends.step_log import SUMS_ONLY, LogOptions, StepLog
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.fanout import fanout
from spikeport.compile.image.tables import BLOCK_SETTINGS, offsets, part
from spikeport.errors import BackendError
from spikeport.hardware_models.activity import Activity


class NengoLoihiChip:
    """An image on nengo-loihi's emulator. Implements `spikeport.backends.chip.Chip`.

    Parameters
    ----------
    image : ChipImage
        The image to run.
    seed : int
        Seed of the chip's noise.
    log : LogOptions
        See `spikeport.backends.step_log.StepLog`.
    """

    link: dict[str, object] | None = None

    def __init__(self, image: ChipImage, seed: int, log: LogOptions = SUMS_ONLY) -> None:
        self._image = image.checked
        blocks, synapses = load_blocks(image)
        self._inputs = load_inputs(image, synapses)
        self._synapses = synapses
        model = SimpleNamespace(
            blocks=blocks,
            inputs=self._inputs,
            probes=[],
            dt=image.manifest.dt_s,
            pes_error_scale=image.manifest.pes_error_scale,
        )
        with np.errstate(invalid="ignore"):  # the emulator fills integer arrays with NaN at first
            self._emulator = EmulatorInterface(model, seed=seed)
        self._outputs = [
            (output.key, image.read_by(i)) for i, output in enumerate(image.manifest.outputs)
        ]
        self._readouts = image.readouts
        self._counter = Counter(
            image.cores, image.manifest.dt_s, image.compartment_core, fanout(image), log
        )
        self._synapse_core = image.group_core
        self._biased = image.compartments.bias != 0
        self._arriving = np.zeros(0, dtype=int)
        self._checks = HostChecks(image)
        self._closed = False

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; see `spikeport.backends.chip.Chip.step`."""
        if self._closed:
            raise BackendError(CLOSED)
        sources = self._checks.checked(spikes, errors)
        now = self._emulator.t + 1
        self._emulator.host2chip(
            zip(self._inputs, itertools.repeat(now), by_input(self._image, sources)),
            [(self._synapses[group], now, error) for group, error in errors.items()],
        )
        self._emulator.step()
        self._count(sources)
        state = self._emulator.compartment
        return [getattr(state, key)[compartments] for key, compartments in self._outputs]

    def _count(self, spikes: np.ndarray) -> None:
        state = self._emulator.compartment
        active = self._biased | state.spiked | (state.current != 0) | (state.voltage != 0)
        active |= state.input[0] != 0
        self._counter.step(
            self._arriving, state.spiked, active, self._learning_updates(), len(spikes)
        )
        self._counter.readout_spikes += int(state.spiked[self._readouts].sum())
        from_host = self._image.n_compartments + spikes
        self._arriving = np.concatenate([np.flatnonzero(state.spiked), from_host]).astype(int)

    def _learning_updates(self) -> np.ndarray:
        updates = np.zeros(self._image.n_cores, dtype=int)
        for group, synapse in enumerate(self._synapses):
            if synapse.learning and self._emulator.t % synapse.learn_epoch == 0:
                updates[self._synapse_core[group]] += synapse.size()
        return updates

    @property
    def log(self) -> StepLog:
        """The counts of the chip's steps."""
        return self._counter.log

    def activity(self) -> Activity:
        """Return the counts; see `spikeport.backends.chip.Chip.activity`."""
        return self._counter.activity()

    def close(self) -> None:
        """Free the emulator; see `spikeport.backends.chip.Chip.close`."""
        self._closed = True
        try:
            self._counter.close()
        finally:  # the disk may be full
            self._emulator.close()


def by_input(image: ChipImage, spikes: np.ndarray) -> list[np.ndarray]:
    """Return the sources that spike in each input, numbered from 0 within the input."""
    ends = itertools.pairwise(offsets(image.inputs.size))
    return [spikes[(spikes >= a) & (spikes < b)] - a for a, b in ends]


def load_blocks(image: ChipImage) -> tuple[list[LoihiBlock], list[Synapse]]:
    """Return nengo-loihi's blocks and synapse groups, in the order of the image."""
    blocks = [_block(image, b) for b in range(image.n_blocks)]
    synapses = []
    for group, block in enumerate(image.groups.block):
        synapses.append(_synapse(image, group))
        blocks[block].add_synapse(synapses[-1])
    for route in np.flatnonzero(image.routes.from_input == 0):
        blocks[image.routes.source[route]].add_axon(_axon(image, route, synapses))
    return blocks, synapses


def load_inputs(image: ChipImage, synapses: list[Synapse]) -> list[SpikeInput]:
    """Return nengo-loihi's spike inputs, in the order of the image."""
    inputs = [SpikeInput(int(n)) for n in image.inputs.size]
    for route in np.flatnonzero(image.routes.from_input == 1):
        inputs[image.routes.source[route]].add_axon(_axon(image, route, synapses))
    return inputs


def _block(image: ChipImage, b: int) -> LoihiBlock:
    mine = part(image.blocks.start, b)
    block = LoihiBlock(mine.stop - mine.start, label=image.manifest.blocks[b].label)
    state = block.compartment
    for name in ("bias", "decay_u", "decay_v", "vth", "refract_delay"):
        setattr(state, name, getattr(image.compartments, name)[mine].astype(np.int32))
    state.enable_noise = image.compartments.enable_noise[mine].astype(bool)
    for name in BLOCK_SETTINGS:
        setattr(state, name, int(getattr(image.blocks, name)[b]))
    # As after nengo-loihi's discretiser: the decay's factor is in the weights and thresholds.
    state.scale_u = state.scale_v = False
    return block


def _synapse(image: ChipImage, group: int) -> Synapse:
    axons, rows = part(image.groups.axon_start, group), part(image.groups.row_start, group)
    synapse = Synapse(axons.stop - axons.start, label=image.manifest.groups[group].label)
    synapse.pop_type = int(image.groups.pop_type[group])
    synapse.axon_to_weight_map = image.in_axons.row[axons]
    synapse.axon_compartment_bases = image.in_axons.base[axons]
    numbers = range(rows.start, rows.stop)
    shapes = [(part(image.rows.start, r), image.rows.atoms[r]) for r in numbers]
    weight, index = image.synapses.weight, image.synapses.index
    synapse.weights = [weight[mine].reshape(n, -1).astype(np.int32) for mine, n in shapes]
    synapse.indices = [index[mine].reshape(n, -1).astype(np.int32) for mine, n in shapes]
    synapse.synapse_cfg = SynapseConfig(**image.format_of(group))
    _set_learning(synapse, image.learning_of(group))
    return synapse


def _set_learning(synapse: Synapse, learning: dict[str, float]) -> None:
    synapse.learning = bool(learning["on"])
    if synapse.learning:
        synapse._lr_int, synapse._lr_exp = int(learning["lr_int"]), int(learning["lr_exp"])
        synapse.tracing_tau = int(learning["tracing_tau"])
        synapse.tracing_mag = learning["tracing_mag"]
        synapse.train_epoch = int(learning["train_epoch"])
        synapse.learn_epoch = int(learning["learn_epoch"])


def _axon(image: ChipImage, route: int | np.integer, synapses: list[Synapse]) -> Axon:
    mine = part(image.routes.start, route)
    targets = image.out_axons.axon[mine]
    # A compartment with a negative target does not use the axon.
    axon = Axon(np.unique(targets[targets >= 0]).size)
    axon.target = synapses[image.routes.group[route]]
    axon.set_compartment_axon_map(targets, image.out_axons.atom[mine])
    return axon
