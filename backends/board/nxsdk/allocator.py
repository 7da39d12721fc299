"""An allocator for nengo-loihi that follows spikeport's placement."""

from nengo_loihi.block import LoihiBlock
from nengo_loihi.hardware import allocators
from nengo_loihi.hardware.nxsdk_objects import Board, Core

from spikeport.backends.board.nxsdk.model import Model, Placement
from spikeport.errors import BackendError

CORES_PER_CHIP: int = allocators.Greedy().cores_per_chip


def n_chips(placement: Placement) -> int:
    """Return the number of chips that a placement needs."""
    return -(-len(placement.blocks_of) // CORES_PER_CHIP)


class Allocator(allocators.Allocator):
    """Allocator that puts blocks on the cores of a placement, also several blocks on one core.

    nengo-loihi's own allocators give each block a core; its builder takes any number of blocks.

    Parameters
    ----------
    placement : Placement
        The core of each block.
    """

    def __init__(self, placement: Placement) -> None:
        self._placement = placement

    def __call__(self, model: Model, n_chips: int) -> Board:
        """Return the board of a model.

        Raises
        ------
        BackendError
            If the placement needs more chips than the board has.
        """
        board = Board()
        for source in model.inputs:
            self.input_to_board(source, board)
        for number, blocks in enumerate(self._placement.blocks_of):
            if number == n_chips * CORES_PER_CHIP:
                raise BackendError(
                    f"placement on {len(self._placement.blocks_of)} cores; the board has "
                    f"{n_chips} chips of {CORES_PER_CHIP}"
                )
            if number % CORES_PER_CHIP == 0:
                board.new_chip()
            _fill(board.chips[-1].new_core(), [model.blocks[b] for b in blocks])
        board.probes.extend(model.probes)
        return board


def _fill(core: Core, blocks: list[LoihiBlock]) -> None:
    """Give a core its blocks, and the profiles and synapses of these."""
    for block in blocks:
        core.add_block(block)
    core.compartment_cfgs, core.compartment_cfg_idxs = allocators.core_compartment_cfgs(core)
    core.vth_cfgs, core.vth_cfg_idxs = allocators.core_vth_cfgs(core)
    for synapse in core.iterate_synapses():
        core.add_synapse(synapse)
    core.stdp_pre_cfgs, core.stdp_pre_cfg_idxs = allocators.core_stdp_pre_cfgs(core)
    core.stdp_pre_cfg_idx = core.stdp_cfg_idx = None  # the builder sets these
