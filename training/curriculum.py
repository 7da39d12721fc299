"""The stages of training, as data: what is asked, and what disturbs, from which step on."""

from dataclasses import dataclass, field, replace

from spikeport.robot.description import JOINTS
from spikeport.training.commands import CommandRange
from spikeport.training.environment import TrainingTask
from spikeport.training.hidden_noise import HiddenNoise
from spikeport.training.randomisation import Randomisation
from spikeport.training.rewards import RewardSettings, Weights


@dataclass(frozen=True)
class Stage:
    """From ``first_step`` (control steps of all robots together) on.

    Joints that are ``held`` stay where they are in the default pose.
    """

    name: str
    first_step: int
    task: TrainingTask = field(default_factory=TrainingTask)
    entropy: float = 0.0
    hidden_noise: HiddenNoise = field(default_factory=HiddenNoise)
    held: tuple[str, ...] = ()


_STEP = TrainingTask(
    commands=CommandRange(vx_m_s=(0.4, 1.0), wz_rad_s=0.6),
    randomisation=Randomisation(push_m_s=0.2),
    weights=Weights(lift=4.0, late_lift=-2.0),
    scales=RewardSettings(step_s=0.32, longest_step_s=0.45),
)
"""Lifting a foot pays more than standing: with half these weights, two seeds of three stood. Asked
for steps of 0.42 s, one that stepped turned badly and fell."""

_STRIDE = replace(
    _STEP, weights=Weights(air_time=4.0, early_touchdown=-0.7, high_foot=-15.0, hips=-0.6)
)
"""Feet that have learned to leave the floor are kept low, and hips from twisting, from here on: a
gait that has settled keeps both."""

_WIDE = replace(
    _STRIDE,
    commands=CommandRange(turning=0.1, standing=0.2),
    randomisation=Randomisation(push_m_s=0.25),
    weights=replace(
        _STRIDE.weights,
        alive=2.0,
        track_velocity=2.5,
        track_yaw_rate=2.0,
        stand=3.0,
        restless=-20.0,
        low_pelvis=-20.0,
        tilt=-4.0,
        torso=-0.6,
    ),
    scales=replace(_STRIDE.scales, vx_sd_m_s=0.35, wz_sd_rad_s=0.35),
)
"""Staying up pays: where costs outweigh what a step earns, falling would be no loss."""

_NOISY = replace(
    _WIDE,
    commands=replace(_WIDE.commands, standing=0.25),
    randomisation=Randomisation(
        push_m_s=0.25, joint_offset_sd_rad=0.03, action_noise_sd=0.1, busy_arms=0.5
    ),
    weights=replace(
        _WIDE.weights,
        track_velocity=3.5,
        track_yaw_rate=3.0,
        on_average=4.0,
        stand=6.0,
        restless=-60.0,
        early_touchdown=-1.0,
        high_foot=-20.0,
        hips=-1.0,
        torso=-1.2,
        impact=-0.001,
        action_jerk=-0.015,
    ),
    scales=replace(_WIDE.scales, vx_sd_m_s=0.2, wz_sd_rad_s=0.25, high_m=0.12),
)
_STEADY = replace(
    _NOISY,
    commands=replace(_NOISY.commands, turning=0.2, still=0.02),
    weights=replace(_NOISY.weights, track_velocity=5.0, track_yaw_rate=4.0),
)
_UPRIGHT = replace(
    _STEADY,
    commands=replace(_STEADY.commands, standing=0.3),
    weights=replace(
        _STEADY.weights, track_yaw_rate=5.0, early_touchdown=-1.5, hips=-2.0, tilt=-10.0
    ),
)
_PRECISE = replace(
    _UPRIGHT,
    randomisation=replace(_UPRIGHT.randomisation, push_m_s=0.15, joint_offset_sd_rad=0.015),
    weights=replace(_UPRIGHT.weights, fall=-2000.0),
    scales=replace(_UPRIGHT.scales, vx_sd_m_s=0.12, wz_sd_rad_s=0.2),
)
"""Not before speeds are right to within these widths: far from them, no change gains anything.
Legs on the chip, their read-out refitted, were off by 0.005 rad over 0.8 s and by 0.03 rad in 20 ms
(rms): offset and noise of the targets are three and nearly two times as large. Falls are rare by
now; were they as cheap as before, they would become more frequent again."""

_HELD = tuple(name for name in JOINTS if "shoulder" in name or "elbow" in name or name == "torso")
"""Joints that are held: the effect of their actions is lost in the noise of the rewards."""

_SPIKES = HiddenNoise(white=0.03, lasting=0.03)

STAGES = (
    Stage("step", 0, _STEP, entropy=0.001),
    Stage("stride", 2_000_000, _STRIDE, entropy=0.001),
    Stage("wide", 3_500_000, _WIDE, entropy=0.0005, held=_HELD),
    Stage("noisy", 5_500_000, _NOISY, 0.0005, _SPIKES, held=_HELD),
    Stage("steady", 9_000_000, _STEADY, 0.0, _SPIKES, held=_HELD),
    Stage("upright", 13_500_000, _UPRIGHT, 0.0, _SPIKES, held=_HELD),
    Stage("precise", 18_000_000, _PRECISE, 0.0, _SPIKES, held=_HELD),
)
"""In order; sources of the figures: see `spikeport.training.rewards`."""


def without_hidden_noise(stages: tuple[Stage, ...] = STAGES) -> tuple[Stage, ...]:
    """Return the stages without noise on hidden units, for a policy that is not made for spikes."""
    return tuple(replace(stage, hidden_noise=HiddenNoise()) for stage in stages)


def stage_at(step: int, stages: tuple[Stage, ...] = STAGES) -> Stage:
    """Return the stage that a control step belongs to."""
    return [stage for stage in stages if stage.first_step <= step][-1]
