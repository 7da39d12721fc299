"""The settings of all experiments in which a policy of neurons walks the robot."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from spikeport.errors import UsageError, unknown
from spikeport.networks.loading.description import Description
from spikeport.networks.loading.files import files_of
from spikeport.networks.loading.walking import DESCRIBE, load_walking
from spikeport.networks.option_checks import check_name_or_file, check_seed
from spikeport.networks.policy import PolicyOptions
from spikeport.networks.walking_policy import POLICIES, SHIPPED, WalkingPolicy
from spikeport.robot import menagerie
from spikeport.robot.description import DEFAULT_POSE, GAINS, JOINTS
from spikeport.robot.perturbation import MENAGERIE, NONE, Perturbation
from spikeport.robot.walk_interface import ACTION_SCALE_RAD, CONTROL_DT_S

CONVERSION = ("n_neurons", "tau_fwd", "tau_out", "units", "solve")
"""Settings that are also those of `spikeport.networks.policy.PolicyOptions`."""

OF_NEURONS = (*CONVERSION, "gait")
"""Settings that a policy without neurons has no use for."""

N_NEURONS = 4
"""Neurons of a unit. The paper has 20, which follow paths no better once the read-out is
calibrated, and need 20 times as many synaptic operations (docs/walk.md)."""

_PUSHED = Perturbation(push=0.8, push_every=1.0)
GAITS = {"calm": (NONE,), "rough": (_PUSHED, replace(_PUSHED, terrain="slope:6"))}
"""The perturbations of the walks that neurons are made and calibrated for, by value of ``gait``. A
robot regains its balance, or falls, in the 0.5 to 1.5 s between two pushes."""

SPIKING, EXACT = "spiking", "mlp"
"""Values of ``policy`` that name no policy: the default one in neurons, and, in some experiments,
without."""

AUTO = "auto"
"""A value of ``calibrated``: true or false, depending on the backend."""

H1 = Description(
    joints=JOINTS,
    pose_rad=DEFAULT_POSE,
    gains=GAINS,
    action_scale_rad=dict.fromkeys(JOINTS, ACTION_SCALE_RAD),
    control_dt_s=CONTROL_DT_S,
)
"""The robot that policies are loaded for."""


def load_policy(
    path: Path = SHIPPED,
    description: Path | None = None,
    activation: str | None = None,
    describe: str = DESCRIBE,
    output: str | None = None,
) -> WalkingPolicy:
    """Load a policy for the H1; see `spikeport.networks.loading.walking.load_walking`."""
    return load_walking(path, H1, description, activation, describe, output)


@dataclass(frozen=True, kw_only=True)
class PolicySettings(Perturbation):
    """Settings of the policy, the robot's appearance, and its perturbations.

    ``policy`` is a shipped policy, ``h1_walk`` or ``h1_robust``, ``spiking`` for the first of them,
    or the file of a policy to convert in its place; ``description`` is the file of Isaac Lab's
    environment that comes with a foreign policy. ``n_neurons`` is the number of neurons of a hidden
    unit, an even number, half of them for each sign. ``tau_fwd`` and ``tau_out`` are the time
    constants of the filters between layers and of the action, in s. ``units`` is the neurons of a
    unit: ``hybrid`` is spiking rectified linear for positive and LIF for negative input; ``lif``,
    ``relu`` or ``if`` (integrate-and-fire) is the same for both, and so is ``bent``, rectified
    linear neurons of which half fire only further out. ``solve`` is ``unit`` if the policy's
    weights are kept, ``layer`` if those between two layers are solved for anew. ``network_seed``
    draws the neurons. ``gait`` is ``calm`` or ``rough``: neurons that are made and calibrated for a
    calm gait do not know the observations of a robot that is pushed, or that walks on a slope.
    ``calibrated`` fits read-out and trim to the spikes of the neurons on the backend
    (`spikeport.experiments.policy.calibration`), or names a file that ``spikeport calibrate``
    wrote, with both. If it is false, the policy is used as converted, as in the paper; ``auto``
    fits it on a chip, but not in float, where this takes many minutes. ``appearance`` is the
    robot's look in pictures: ``primitive``, or ``menagerie`` for meshes. The other settings are
    those of `spikeport.robot.perturbation.Perturbation`.
    """

    policies: ClassVar[tuple[str, ...]] = (SPIKING,)
    """Values of ``policy`` that name neither a shipped policy nor a file."""

    policy: str = SPIKING
    description: str | None = None
    n_neurons: int = N_NEURONS
    tau_fwd: float = PolicyOptions.tau_fwd
    tau_out: float = PolicyOptions.tau_out
    units: str = PolicyOptions.units
    solve: str = PolicyOptions.solve
    network_seed: int = 0
    gait: str = "calm"
    calibrated: bool | str = AUTO
    appearance: str = "primitive"

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        super().__post_init__()
        check_name_or_file("policy", self.policy, (*self.policies, *POLICIES))
        if self.description is not None and self._is_shipped:
            raise UsageError(
                f"description={self.description}: describes the file of a policy; give --set "
                "policy=FILE, or leave it out"
            )
        _ = self.policy_options  # made here to check its values
        if isinstance(self.calibrated, str):
            check_name_or_file("calibrated", self.calibrated, ("true", "false", AUTO))
        if self.gait not in GAITS:
            raise unknown("gait", self.gait, GAITS)
        check_seed("network_seed", self.network_seed)

    @property
    def _is_shipped(self) -> bool:
        return self.policy in self.policies or self.policy in POLICIES

    @property
    def files(self) -> list[Path]:
        """The files that a run reads.

        Raises
        ------
        MissingExtraError, UsageError
            If Menagerie's robot is asked for and not on this machine.
        """
        found = [] if self._is_shipped else files_of(Path(self.policy))
        if self.description is not None:
            found.append(Path(self.description))
        if isinstance(self.calibrated, str) and self.calibrated != AUTO:
            found.append(Path(self.calibrated))
        if self.robot_model == MENAGERIE:
            found.append(menagerie.model_file(menagerie.ROBOT_MODEL))
        return found

    @property
    def conversion(self) -> dict[str, object]:
        """The settings of the policy's conversion into neurons."""
        return {name: getattr(self, name) for name in CONVERSION}

    @property
    def policy_options(self) -> PolicyOptions:
        """Neurons and filters of the policy."""
        return PolicyOptions(
            n_neurons=self.n_neurons,
            tau_fwd=self.tau_fwd,
            tau_out=self.tau_out,
            units=self.units,
            solve=self.solve,
        )

    def walking_policy(self) -> WalkingPolicy:
        """Load the policy from its file.

        Raises
        ------
        UsageError
            If the file holds no policy, or a policy for another robot.
        """
        if self._is_shipped:
            return load_policy(POLICIES.get(self.policy, SHIPPED))
        description = None if self.description is None else Path(self.description)
        describe = "--set description=env.yaml"
        return load_policy(Path(self.policy), description, describe=describe)
