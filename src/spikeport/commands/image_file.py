"""The image that a command reads, by its file or by the folder of its compile."""

import os
from pathlib import Path

from spikeport.errors import UsageError

IMAGE = "image.npz"
"""The file of the image in the folder of a compile."""


def image_file(path: Path) -> Path:
    """Return the file of an image: the path, or the image in this folder.

    Raises
    ------
    UsageError
        If the folder has no image.
    """
    if not os.path.isdir(path):
        return path
    if not (path / IMAGE).is_file():
        raise UsageError(f"{path}: has no {IMAGE}; give an image, or a folder of `compile --out`")
    return path / IMAGE
