"""The stages of training, as data: what is asked, and what disturbs, from which step on."""

from dataclasses import dataclass, field, replace

from spikeport.training.commands import CommandRange
from spikeport.training.environment import Task
from spikeport.training.randomisation import Randomisation
from spikeport.training.rewards import RewardSettings, Weights


@dataclass(frozen=True)
class Stage:
    """From ``first_step`` (control steps of all robots together) on."""

    name: str
    first_step: int
    task: Task = field(default_factory=Task)
    entropy: float = 0.0
    hidden_noise: float = 0.0


_STEP = Task(
    commands=CommandRange(vx_m_s=(0.4, 1.0), wz_rad_s=0.6),
    randomisation=Randomisation(push_m_s=0.2),
    weights=Weights(),
    scales=RewardSettings(),
)
_STRIDE = replace(_STEP, weights=replace(_STEP.weights, air_time=4.0, early_touchdown=-0.7))
_ALL_WAYS = CommandRange(vx_m_s=(-0.3, 1.0), turning=0.1)
"""Steps back are what catches a robot that has braked too hard."""

_WIDE = Task(
    commands=_ALL_WAYS,
    randomisation=Randomisation(push_m_s=0.3),
    weights=replace(_STRIDE.weights, track_velocity=2.5, track_yaw_rate=1.4, torso=-0.6, tilt=-2.0),
    scales=replace(_STRIDE.scales, vx_sd_m_s=0.35, wz_sd_rad_s=0.35),
)
_NOISY = Task(
    commands=_ALL_WAYS,
    randomisation=Randomisation(push_m_s=0.4, joint_offset_sd_rad=0.05, action_noise_sd=0.1),
    weights=replace(
        _WIDE.weights,
        track_velocity=3.5,
        track_yaw_rate=1.7,
        high_foot=-10.0,
        torso=-1.2,
        spread_arms=-0.6,
        tilt=-4.0,
        impact=-0.001,
        action_jerk=-0.015,
    ),
    scales=replace(_WIDE.scales, vx_sd_m_s=0.2, wz_sd_rad_s=0.25, high_m=0.12),
)
_PRECISE = replace(
    _NOISY,
    commands=replace(_ALL_WAYS, turning=0.15, still=0.02),
    weights=replace(_NOISY.weights, track_velocity=4.0, track_yaw_rate=2.0),
    scales=replace(_NOISY.scales, vx_sd_m_s=0.12, wz_sd_rad_s=0.2),
)
_STANDING = replace(
    _PRECISE,
    commands=replace(_PRECISE.commands, standing=0.2),
    randomisation=replace(_PRECISE.randomisation, busy_arms=0.5, push_m_s=0.25),
    weights=replace(_PRECISE.weights, stand=2.0, track_yaw_rate=3.5),
)
STAGES = (
    Stage("step", 0, _STEP, entropy=0.001),
    Stage("stride", 2_000_000, _STRIDE, entropy=0.001),
    Stage("wide", 3_500_000, _WIDE, entropy=0.0005),
    Stage("noisy", 5_500_000, _NOISY, hidden_noise=0.06),
    Stage("precise", 8_500_000, _PRECISE, hidden_noise=0.06),
    Stage("standing", 11_000_000, _STANDING, hidden_noise=0.06),
)
"""In order; sources of the figures: see `spikeport.training.rewards`."""


def stage_at(step: int, stages: tuple[Stage, ...] = STAGES) -> Stage:
    """The stage that a control step belongs to."""
    return [stage for stage in stages if stage.first_step <= step][-1]
