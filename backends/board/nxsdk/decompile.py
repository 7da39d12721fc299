"""An image made from registers: the computation of a chip, read from its registers alone.

A core becomes a block, since registers do not say where one block of a core ends.
"""

from collections.abc import Sequence

import numpy as np
from nengo_loihi.block import SynapseConfig

from spikeport.backends.board.nxsdk.groups import Group, groups_of, value, values
from spikeport.backends.board.nxsdk.recording import Core
from spikeport.backends.board.nxsdk.routes import routes_of
from spikeport.backends.board.nxsdk.written import Written
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import (
    BlockEntry,
    Encoding,
    GroupEntry,
    InputEntry,
    Manifest,
)
from spikeport.compile.image.tables import (
    Blocks,
    Compartments,
    Decoders,
    Groups,
    InAxons,
    Inputs,
    Outputs,
    Reads,
    Rows,
    RowTables,
    Synapses,
    flat,
    offsets,
    ranges,
)
from spikeport.compile.image.validation import LEARNING
from spikeport.errors import BackendError

FORMAT = {
    "weight_limit_mant": "wgtLimitMant",
    "weight_limit_exp": "wgtLimitExp",
    "weight_exp": "wgtExp",
    "disc_max_weight": "discMaxWgt",
    "learning_cfg": "learningCfg",
    "tag_bits": "tagBits",
    "delay_bits": "dlyBits",
    "weight_bits": "wgtBits",
    "reuse_synapse_data": "reuseSynData",
    "n_synapses": "numSynapses",
    "idx_offset": "cIdxOffset",
    "idx_mult": "cIdxMult",
    "skip_bits": "skipBits",
    "idx_bits": "idxBits",
    "synapse_type": "synType",
    "fanout_type": "fanoutType",
    "compression": "compression",
    "stdp_cfg": "stdpProfile",
    "ignore_delay": "ignoreDly",
}
"""The field of a synapse format's register, by nengo-loihi's name of the setting."""
THRESHOLD_SHIFT = 6
"""A threshold's mantissa counts units of 2^6."""
NOISE_SHIFTED = 6
"""Below this exponent in the register, the chip uses the next larger exponent for noise."""
UPDATED = 2
"""The phase of a compartment that is in use."""
PHASES = 4
"""Number of compartments whose phases are in one register."""


def decompile(written: Written, dt_s: float) -> ChipImage:
    """Return the image that registers hold, without outputs, learning and names.

    Parameters
    ----------
    written : Written
        The registers, and the axons of the host's inputs.
    dt_s : float
        The time step, in seconds, which no register holds.

    Raises
    ------
    BackendError
        If a register was not written, or two registers contradict each other.
    ImageError
        If a register points at something that does not exist.
    """
    cores = [core for core in written.board.cores if core.compartments]
    groups = [group for number, core in enumerate(cores) for group in groups_of(number, core)]
    input_sizes = [len(axon_map) for axon_map in written.inputs]
    routes, out_axons = routes_of(cores, groups, written.inputs)
    return ChipImage(
        manifest=_manifest(len(cores), len(groups), input_sizes, dt_s),
        blocks=_blocks(cores),
        compartments=_compartments(cores),
        groups=_groups(cores, groups),
        in_axons=InAxons(
            row=np.array([g.rows[axon.row] for g in groups for axon in g.axons], dtype=int),
            base=np.array([axon.base for g in groups for axon in g.axons], dtype=int),
        ),
        **_rows(cores, groups),
        routes=routes,
        out_axons=out_axons,
        inputs=Inputs(size=np.array(input_sizes, dtype=int)),
        outputs=Outputs(start=np.zeros(1), weight_start=np.zeros(1)),
        reads=Reads(compartment=np.zeros(0)),
        decoders=Decoders(weight=np.zeros(0)),
    ).checked


def _manifest(n_blocks: int, n_groups: int, input_sizes: Sequence[int], dt_s: float) -> Manifest:
    return Manifest(
        chip="registers",
        dt_s=dt_s,
        pes_error_scale=1.0,
        synapse_format=SynapseConfig.params,
        learning=LEARNING,
        weight_bits=tuple(SynapseConfig.WEIGHT_BITS_MAP),
        index_bits=tuple(SynapseConfig.INDEX_BITS_MAP),
        blocks=tuple(BlockEntry("ensemble", f"core {i}") for i in range(n_blocks)),
        groups=tuple(GroupEntry(f"group {i}") for i in range(n_groups)),
        inputs=tuple(
            InputEntry(f"input {i}", n, Encoding("spikes")) for i, n in enumerate(input_sizes)
        ),
        outputs=(),
    )


def _blocks(cores: Sequence[Core]) -> Blocks:
    shared = [core.dendriteSharedCfg for core in cores]
    exponent = values(shared, "noiseExp0")
    return Blocks(
        start=offsets(len(core.compartments) for core in cores),
        core=np.arange(len(cores)),
        # The registers hold exponents: vmin's in steps of 1, vmax's in steps of 2 from 9 on.
        vmin=1 - 2 ** values(shared, "negVmLimit"),
        vmax=2 ** (2 * values(shared, "posVmLimit") + 9) - 1,
        noise_offset=values(shared, "noiseMantOffset0"),
        noise_exp=exponent + (exponent < NOISE_SHIFTED),
        noise_at_membrane=values(shared, "noiseAtDendOrVm"),
    )


def _compartments(cores: Sequence[Core]) -> Compartments:
    """Return constants of compartments; each points at profiles of its core."""
    used = [(core, core.compartments[i]) for core in cores for i in _updated(core)]
    states = [state for _, state in used]
    profiles = [core.bank("cxProfileCfg")[value(state, "cxProfile")] for core, state in used]
    thresholds = [
        core.bank("vthProfileCfg")[value(state, "vthProfile")].staticCfg for core, state in used
    ]
    return Compartments(
        bias=values(states, "bias") << values(states, "biasExp"),
        decay_u=values(profiles, "decayU"),
        decay_v=values(profiles, "decayV"),
        vth=values(thresholds, "vth") << THRESHOLD_SHIFT,
        refract_delay=values(profiles, "refractDelay"),
        enable_noise=values(profiles, "enableNoise"),
    )


def _updated(core: Core) -> range:
    """Return the compartments of a core; BackendError if the core does not update all of them."""
    n = len(core.compartments)
    phase = core.bank("cxMetaState")
    on = all(value(phase[i // PHASES], f"phase{i % PHASES}") == UPDATED for i in range(n))
    if not on or value(core.numUpdates, "numUpdates") != -(-n // PHASES):
        raise BackendError(f"core {core.id} does not update all of its {n} compartments")
    return range(n)


def _groups(cores: Sequence[Core], groups: Sequence[Group]) -> Groups:
    forms = [cores[group.core].bank("synapseFmt")[group.form] for group in groups]
    columns = [values(forms, FORMAT[name]) for name in SynapseConfig.params]
    return Groups(
        block=np.array([group.core for group in groups], dtype=int),
        pop_type=np.array([group.kind for group in groups], dtype=int),
        format=np.stack(columns, axis=1),
        learning=np.zeros((len(groups), len(LEARNING))),
        axon_start=offsets(len(group.axons) for group in groups),
        row_start=offsets(len(group.rows) for group in groups),
    )


def _rows(cores: Sequence[Core], groups: Sequence[Group]) -> RowTables:
    """Return rows and synapses; a weight is its mantissa times 2^(6 + the format's exponent)."""
    weights, indices, atoms, sizes = [], [], [], []
    for group in groups:
        core = cores[group.core]
        exponent = value(core.bank("synapseFmt")[group.form], "wgtExp")
        # The reshape keeps three columns even where a group has no rows.
        begin, length, n_atoms = np.array(list(group.rows), dtype=int).reshape(-1, 3).T
        mine = ranges(begin, length * n_atoms)
        weights.append(core.synapses.column("Wgt")[mine] * SynapseConfig.get_scale(exponent))
        indices.append(core.synapses.column("CIdx")[mine])
        atoms.append(n_atoms)
        sizes.append(length * n_atoms)
    return RowTables(
        rows=Rows(atoms=flat(atoms), start=offsets(flat(sizes))),
        synapses=Synapses(weight=flat(weights), index=flat(indices)),
    )
