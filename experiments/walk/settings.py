"""The settings of the walking experiment."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from spikeport.errors import UsageError, unknown
from spikeport.experiments.policy.settings import EXACT, SPIKING, PolicySettings
from spikeport.experiments.walk.approach import LAWS, TURN_FIRST
from spikeport.experiments.walk.path_file import FASTEST_M_S, path_files

FOLLOWERS = ("spiking", "exact")


@dataclass(frozen=True, kw_only=True)
class WalkSettings(PolicySettings):
    """Settings of the path and the controller; see `PolicySettings` for the other settings.

    ``path`` is ``line``, ``s-curve``, ``figure-eight`` or ``loop``, walked at ``speed`` m/s, which
    the reference reaches in ``ramp`` s, or a CSV file with columns ``t_s,x_m,y_m``.
    ``follower`` is ``spiking`` or ``exact``; ``law`` is the way to obey its commands,
    ``turn-first`` or ``paper`` (docs/walk.md). ``policy`` can also be ``mlp``,
    the shipped policy without neurons. ``silence`` is the share of the policy's ensembles that are
    inhibited from ``silence_at`` s on.
    """

    policies: ClassVar[tuple[str, ...]] = (SPIKING, EXACT)

    path: str = "figure-eight"
    speed: float = 0.5
    ramp: float = 0.0
    follower: str = "spiking"
    law: str = TURN_FIRST
    silence: float = 0.0
    silence_at: float = 25.0

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        super().__post_init__()
        if self.follower not in FOLLOWERS:
            raise unknown("follower", self.follower, FOLLOWERS)
        if self.law not in LAWS:
            raise unknown("law", self.law, LAWS)
        if not 0 < self.speed <= FASTEST_M_S:
            raise UsageError(
                f"speed={self.speed:g}: the policy is trained for speeds above 0 and up to "
                f"{FASTEST_M_S:g} m/s; choose one of these"
            )
        if path_files(self.path) and self.speed != WalkSettings.speed:
            raise UsageError(
                f"speed={self.speed:g}: '{self.path}' has times of its own; cure: leave it out, or "
                "change the times"
            )
        if not 0 <= self.ramp < math.inf:
            raise UsageError(f"ramp={self.ramp:g}: a time must be from 0 on and finite")
        if not 0 <= self.silence <= 1:
            raise UsageError(f"silence={self.silence:g}: a share must be from 0 to 1")
        if not 0 <= self.silence_at < math.inf:
            raise UsageError(f"silence_at={self.silence_at:g}: a time must be from 0 on and finite")

    @property
    def files(self) -> list[Path]:
        """The files that a run reads."""
        return [*super().files, *path_files(self.path)]
