"""The modules of an image: each ensemble, and the neurons that relay or read out a connection."""

import numpy as np

from spikeport.compile.image.chip_image import ChipImage


def module_of_blocks(image: ChipImage) -> list[str]:
    """Return the module of each block: its owner. A block may be the whole module or a piece."""
    return [block.owner for block in image.manifest.blocks]


def modules(image: ChipImage) -> tuple[str, ...]:
    """Return the modules, in the order of their first blocks."""
    return tuple(dict.fromkeys(module_of_blocks(image)))


def by_module(image: ChipImage) -> ChipImage:
    """Return the image with a core for each module, so that counts by core are counts by module."""
    number = {name: i for i, name in enumerate(modules(image))}
    return image.on_cores(np.array([number[name] for name in module_of_blocks(image)], dtype=int))
