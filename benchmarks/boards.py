"""A board with more chips than the built-in boards have."""

import re
from pathlib import Path

from spikeport.hardware_models.chip import BUILT_IN

CHIPS = 32


def board(folder: Path) -> Path:
    """Return the file of a board of 32 chips like Loihi."""
    text = (BUILT_IN / "loihi.toml").read_text(encoding="utf-8")
    path = folder / "board.toml"
    path.write_text(
        re.sub(r"(\[limits\.chips\]\nvalue = )\d+", rf"\g<1>{CHIPS}", text), encoding="utf-8"
    )
    return path
