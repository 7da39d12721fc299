"""The settings of a simulated robot."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from spikeport.errors import UsageError
from spikeport.robot.link.codec import TICK_S

LOCK_STEP_HZ = 200.0
"""Physics steps a second in lock-step: as of a run without an interface."""
LOWEST_HZ, HIGHEST_HZ = 200.0, 1000.0
WATCHDOG_S = 0.1


@dataclass(frozen=True)
class RobotSettings:
    """The settings of a simulated robot.

    Attributes
    ----------
    rate_hz : float
        Physics steps a second, each of a whole number of ticks of 1 ms.
    hoist : bool
        Whether it hangs by its pelvis.
    watchdog_s : float
        Time without a valid command after which it is damped.
    seed : int
        Draws the posture that it begins in.
    posture_rad : mapping of str to float
        Angles of joints that begin elsewhere than in the default pose.
    """

    rate_hz: float = LOCK_STEP_HZ
    hoist: bool = False
    watchdog_s: float = WATCHDOG_S
    seed: int = 0
    posture_rad: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        ticks = 1 / (TICK_S * self.rate_hz) if self.rate_hz > 0 else 0.0
        if not LOWEST_HZ <= self.rate_hz <= HIGHEST_HZ or abs(ticks - round(ticks)) > 1e-9:
            raise UsageError(
                f"{self.rate_hz:g} physics steps a second: must be from {LOWEST_HZ:g} to "
                f"{HIGHEST_HZ:g}, and each a whole number of ms, as at 200, 500 or 1000"
            )
        if not 0 < self.watchdog_s <= 60:
            raise UsageError(
                f"a watchdog of {1000 * self.watchdog_s:g} ms: must be above 0, up to 60,000"
            )
