"""Blocks -> cores. One block a core, in the order they were built, as nengo-loihi does."""

from spikeport.compile.build import Blocks


def place(blocks: Blocks) -> list[int]:
    """The core of each block."""
    return list(range(len(blocks.model.blocks)))
