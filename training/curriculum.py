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
_STRIDE = replace(
    _STEP,
    commands=replace(_STEP.commands, standing=0.2),
    weights=replace(_STEP.weights, air_time=4.0, early_touchdown=-0.7, stand=3.0, restless=-60.0),
)
"""Standing is learned with the first steps: a gait that is settled is hard to stop."""

_WIDE = Task(
    commands=CommandRange(turning=0.1, standing=0.2),
    randomisation=Randomisation(push_m_s=0.25),
    weights=replace(
        _STRIDE.weights,
        alive=2.0,
        track_velocity=2.5,
        track_yaw_rate=2.0,
        torso=-0.6,
        tilt=-4.0,
        low_pelvis=-20.0,
    ),
    scales=replace(_STRIDE.scales, vx_sd_m_s=0.35, wz_sd_rad_s=0.35),
)
"""Staying up pays: where costs outweigh what a step earns, falling would be no loss."""

_NOISY = replace(
    _WIDE,
    randomisation=Randomisation(
        push_m_s=0.25, joint_offset_sd_rad=0.03, action_noise_sd=0.1, busy_arms=0.5
    ),
    weights=replace(
        _WIDE.weights,
        track_velocity=3.5,
        track_yaw_rate=3.0,
        early_touchdown=-1.0,
        high_foot=-10.0,
        torso=-1.2,
        impact=-0.001,
        action_jerk=-0.015,
    ),
    scales=replace(_WIDE.scales, vx_sd_m_s=0.2, wz_sd_rad_s=0.25, high_m=0.12),
)
_PRECISE = replace(
    _NOISY,
    commands=replace(_NOISY.commands, turning=0.15, still=0.02),
    weights=replace(_NOISY.weights, track_velocity=4.0, track_yaw_rate=4.0),
    scales=replace(_NOISY.scales, vx_sd_m_s=0.12, wz_sd_rad_s=0.2),
)
STAGES = (
    Stage("step", 0, _STEP, entropy=0.001),
    Stage("stride", 2_000_000, _STRIDE, entropy=0.001),
    Stage("wide", 4_500_000, _WIDE, entropy=0.0005),
    Stage("noisy", 6_500_000, _NOISY, hidden_noise=0.06),
    Stage("precise", 10_000_000, _PRECISE, hidden_noise=0.06),
)
"""In order; sources of the figures: see `spikeport.training.rewards`."""


def stage_at(step: int, stages: tuple[Stage, ...] = STAGES) -> Stage:
    """The stage that a control step belongs to."""
    return [stage for stage in stages if stage.first_step <= step][-1]
