"""The settings of a simulated robot."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from spikeport.errors import UsageError
from spikeport.robot.link.codec import TICK_S
from spikeport.robot.link.odometer import OdometerErrors

LOCK_STEP_HZ = 200.0
"""Physics steps a second in lock-step, as in a run without an interface."""
LOWEST_HZ, HIGHEST_HZ = 200.0, 1000.0
WATCHDOG_S = 0.1
LONGEST_MODE = 64
"""The most letters of a sport mode's name."""


def is_mode_name(text: str) -> bool:
    """Return whether a text can be the name of a sport mode: short, of printable ASCII letters."""
    return len(text) <= LONGEST_MODE and text.isascii() and text.isprintable()


@dataclass(frozen=True)
class RobotSettings:
    """The settings of a simulated robot.

    Attributes
    ----------
    rate_hz : float
        Physics steps a second, each of a whole number of ticks of 1 ms.
    hoist : bool
        True if the robot hangs by its pelvis.
    watchdog_s : float
        Time without a valid command after which the robot is damped.
    seed : int
        Seed of the robot's first posture.
    posture_rad : mapping of str to float
        Angles of joints that begin elsewhere than in the default pose.
    sport_mode : str
        The mode that alone commands the robot until it is released; empty for none.
    let_down_s : float or None
        Time from the first command until the hoist lowers the robot; None for never.
    odometer : OdometerErrors or None
        Errors of the odometer; None for a robot without one.
    """

    rate_hz: float = LOCK_STEP_HZ
    hoist: bool = False
    watchdog_s: float = WATCHDOG_S
    seed: int = 0
    posture_rad: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    sport_mode: str = ""
    let_down_s: float | None = None
    odometer: OdometerErrors | None = None

    def __post_init__(self) -> None:
        """Check the values; raise UsageError for the first wrong one."""
        ticks = 1 / (TICK_S * self.rate_hz) if self.rate_hz > 0 else 0.0
        if not LOWEST_HZ <= self.rate_hz <= HIGHEST_HZ or abs(ticks - round(ticks)) > 1e-9:
            raise UsageError(
                f"{self.rate_hz:g} physics steps a second: must be from {LOWEST_HZ:g} to "
                f"{HIGHEST_HZ:g}, with a period of whole ms: 200, 250, 500 or 1000"
            )
        if self.let_down_s is not None and not self.hoist:
            raise UsageError("--let-down is for a robot on its --hoist")
        if self.let_down_s is not None and not 0 <= self.let_down_s < math.inf:
            raise UsageError(f"--let-down {self.let_down_s:g}: must be 0 or more, and finite")
        mode = self.sport_mode
        if not is_mode_name(mode):
            raise UsageError(
                f"sport mode {mode[:LONGEST_MODE]!a}: a name of up to {LONGEST_MODE} printable "
                "ASCII letters, as ai"
            )
        if not 0 < self.watchdog_s <= 60:
            raise UsageError(
                f"a watchdog of {1000 * self.watchdog_s:g} ms: must be above 0, up to 60,000"
            )
