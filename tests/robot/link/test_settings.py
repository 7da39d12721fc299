"""Checks of a simulated robot's settings."""

import re
from pathlib import Path

import pytest

from spikeport.errors import UsageError
from spikeport.robot.link.settings import RobotSettings


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"rate_hz": 300.0}, "300 physics steps a second: must be from 200 to 1000"),
        ({"rate_hz": 300.0}, "with a period of whole ms: 200, 250, 500 or 1000"),
        ({"rate_hz": 100.0}, "100 physics steps a second"),
        ({"rate_hz": float("nan")}, "nan physics steps"),
        ({"watchdog_s": 0.0}, "a watchdog of 0 ms: must be above 0"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict[str, float], words: str) -> None:
    with pytest.raises(UsageError, match=words):
        RobotSettings(**settings)


def test_every_rate_that_the_refusal_and_the_documents_name_is_accepted(root: Path) -> None:
    with pytest.raises(UsageError, match=r"whole ms: ([\d, or]+)$") as refusal:
        RobotSettings(rate_hz=300.0)
    named = str(refusal.value).partition("whole ms: ")[2]
    for rate_hz in re.findall(r"\d+", named):
        assert RobotSettings(rate_hz=float(rate_hz)).rate_hz == float(rate_hz)
    assert f"with a period of whole ms: {named}." in (root / "docs" / "commands.md").read_text()
    page = (root / "docs" / "robot.md").read_text().replace("500 (default)", "500")
    assert f"with a period of whole ms: {named};" in page
