"""The files of a conversion, beside the image and the report of its compile."""

from dataclasses import asdict
from pathlib import Path

from spikeport.errors import UsageError
from spikeport.experiments.policy.lint import ConversionLint
from spikeport.files import read_json, write_json
from spikeport.networks.walking_policy import WalkingPolicy

POLICY = "policy.npz"
"""The file of a walking policy, in the folder of its conversion."""
CONVERSION = "conversion.json"
"""The file of a conversion's errors in that folder."""
WALKER = "walking_policy"
"""Its key that is true if a walking policy was written beside it."""


def write_conversion(out: Path, lint: ConversionLint, walker: WalkingPolicy | None) -> None:
    """Write the errors of a conversion and a walking policy, in place of an earlier conversion."""
    if walker is not None:
        walker.save(out / POLICY)
    elif _wrote_policy(out / CONVERSION):  # otherwise the file is the user's own
        (out / POLICY).unlink(missing_ok=True)
    write_json(out / CONVERSION, {**asdict(lint), WALKER: walker is not None})


def _wrote_policy(conversion: Path) -> bool:
    """Return whether an earlier conversion wrote a walking policy beside this file."""
    try:
        held = read_json(conversion)
    except UsageError:
        return False
    return isinstance(held, dict) and held.get(WALKER) is True
