"""Files of chips like Loihi, with other limits."""

import re
from pathlib import Path

from spikeport.hardware_models.chip import BUILT_IN


def chip_file(path: Path, pipeline: str | None = None, **limits: int) -> Path:
    """Write the file of a chip that equals Loihi except for its passes and these limits."""
    text = (BUILT_IN / "loihi.toml").read_text(encoding="utf-8")
    for name, limit in limits.items():
        text, found = re.subn(rf"(\[limits.{name}\]\nvalue = )\d+", rf"\g<1>{limit}", text)
        assert found
    if pipeline is not None:
        text, found = re.subn(r'^pipeline = ".*"$', f'pipeline = "{pipeline}"', text, flags=re.M)
        assert found
    path.write_text(text, encoding="utf-8")
    return path
