"""Checks of a simulated robot's settings."""

import pytest

from spikeport.errors import UsageError
from spikeport.robot.link.settings import RobotSettings


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"rate_hz": 300.0}, "300 physics steps a second: must be from 200 to 1000"),
        ({"rate_hz": 100.0}, "100 physics steps a second"),
        ({"rate_hz": float("nan")}, "nan physics steps"),
        ({"watchdog_s": 0.0}, "a watchdog of 0 ms: must be above 0"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict[str, float], words: str) -> None:
    with pytest.raises(UsageError, match=words):
        RobotSettings(**settings)
