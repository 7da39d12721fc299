"""The file of a policy that a user converts."""

from pathlib import Path

import pytest

from spikeport.commands.destinations import Destinations
from spikeport.commands.options_of_networks import ConvertRequest
from spikeport.commands.policy_file import file_of
from spikeport.errors import UsageError
from spikeport.networks.walking_policy import POLICIES


def named(name: str) -> Path:
    return file_of(ConvertRequest(file=Path(name), to=Destinations()))


def test_a_policy_is_a_file_or_the_name_of_a_shipped_one(tmp_path: Path) -> None:
    assert named("h1_walk") == POLICIES["h1_walk"]
    assert named("some.onnx") == Path("some.onnx")
    (bare := tmp_path / "bare").touch()
    assert named(str(bare)) == bare
    for name in ("h1_wlak", "n" * 300):
        with pytest.raises(UsageError, match=f"^unknown policy '{name}'; choose from: h1_robust"):
            named(name)
