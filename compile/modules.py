"""The modules of an image: each ensemble, and the neurons that relay or read out a connection."""

import re

import numpy as np

from spikeport.compile.image import ChipImage

PIECE = re.compile(r"\[\d+/\d+\]$")


def module_of_blocks(image: ChipImage) -> list[str]:
    """What each block is, or is a piece of: ``a`` for ``a[2/3]``."""
    blocks = image.manifest["blocks"]
    return [PIECE.sub("", block.get("of", block["label"])) for block in blocks]


def modules(image: ChipImage) -> tuple[str, ...]:
    """The modules, in the order of their first blocks."""
    return tuple(dict.fromkeys(module_of_blocks(image)))


def by_module(image: ChipImage) -> ChipImage:
    """The image as if each module had a core of its own: counts by core are then by module."""
    number = {name: i for i, name in enumerate(modules(image))}
    core = np.array([number[name] for name in module_of_blocks(image)], dtype=int)
    return ChipImage(image.manifest, {**image.arrays, "block_core": core})
