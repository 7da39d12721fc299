"""The settings of the walking experiment."""

import math
from dataclasses import dataclass
from pathlib import Path as File

from spikeport.errors import UsageError, unknown
from spikeport.experiments.arm.settings import LARGEST_SEED
from spikeport.experiments.policy.file import load_policy
from spikeport.experiments.walk.path_file import FASTEST_M_S
from spikeport.networks.policy import PolicyOptions
from spikeport.networks.walking_policy import WalkingPolicy

FOLLOWERS = ("spiking", "exact")
POLICIES = ("spiking", "mlp")


@dataclass(frozen=True, kw_only=True)
class WalkSettings:
    """Settings of the path, the controller, and how the robot looks.

    ``path`` is a built-in one (`experiments.paths.SHAPES`), walked at ``speed`` m/s, or a CSV file
    with columns ``t_s,x_m,y_m``. ``follower`` is ``spiking`` or ``exact``; ``policy`` is
    ``spiking``, ``mlp``, or the file of a policy that is to be converted in place of the shipped
    one; ``description`` is the environment's that comes with a foreign one. ``n_neurons`` are those
    of a hidden unit, ``tau_fwd`` and ``tau_out`` the filters between layers and of the action, in
    s. ``network_seed`` draws the neurons. ``calibrated`` refits the read-out to what the neurons do
    on the backend (`experiments.policy_calibration`), or takes it from a file that ``spikeport
    calibrate`` wrote. ``silence`` is the share of the policy's ensembles that are inhibited from
    ``silence_at`` s on. ``appearance`` is that of the robot in pictures: ``primitive``, or
    ``menagerie`` for meshes.
    """

    path: str = "figure-eight"
    speed: float = 0.5
    follower: str = "spiking"
    policy: str = "spiking"
    n_neurons: int = PolicyOptions.n_neurons
    tau_fwd: float = PolicyOptions.tau_fwd
    tau_out: float = PolicyOptions.tau_out
    description: str | None = None
    network_seed: int = 0
    calibrated: bool | str = False
    silence: float = 0.0
    silence_at: float = 25.0
    appearance: str = "primitive"

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        if self.follower not in FOLLOWERS:
            raise unknown("follower", self.follower, FOLLOWERS)
        if self.policy not in POLICIES and not File(self.policy).is_file():
            raise unknown("policy", self.policy, (*POLICIES, "the path of a file"))
        if not 0 < self.speed <= FASTEST_M_S:
            raise UsageError(
                f"speed={self.speed:g}: the policy is trained for speeds above 0 and up to "
                f"{FASTEST_M_S:g} m/s; choose one of these"
            )
        if self.n_neurons < 2 or self.n_neurons % 2:
            raise UsageError(
                f"n_neurons={self.n_neurons}: a unit has as many neurons for each sign; give an "
                "even number from 2 on"
            )
        for key in ("tau_fwd", "tau_out"):
            if not 0 < getattr(self, key) < 1:
                raise UsageError(
                    f"{key}={getattr(self, key):g}: a filter must be above 0 and below 1 s"
                )
        if not 0 <= self.silence <= 1:
            raise UsageError(f"silence={self.silence:g}: a share must be from 0 to 1")
        if not 0 <= self.silence_at < math.inf:
            raise UsageError(f"silence_at={self.silence_at:g}: a time must be from 0 on and finite")
        if not 0 <= self.network_seed <= LARGEST_SEED:
            raise UsageError(
                f"network_seed={self.network_seed}: a seed must be from 0 to {LARGEST_SEED}"
            )

    @property
    def policy_options(self) -> PolicyOptions:
        """Neurons and filters of the policy."""
        return PolicyOptions(n_neurons=self.n_neurons, tau_fwd=self.tau_fwd, tau_out=self.tau_out)

    def walking_policy(self) -> WalkingPolicy:
        """The policy, from its file.

        Raises
        ------
        UsageError
            If the file holds none, or one that is not for this robot.
        """
        if self.policy in POLICIES:
            return load_policy()
        description = None if self.description is None else File(self.description)
        return load_policy(File(self.policy), description)
