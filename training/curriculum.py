"""The stages of training, as data: tasks and disturbances, and the steps at which they begin."""

from dataclasses import dataclass, field, replace

from spikeport.robot.description import JOINTS
from spikeport.training.commands import CommandRange
from spikeport.training.environment import TrainingTask
from spikeport.training.hidden_noise import HiddenNoise
from spikeport.training.randomisation import Randomisation
from spikeport.training.rewards import RewardScales, Weights
from spikeport.training.terrain import Terrain
from spikeport.training.velocity_belief import EstimatorErrors


@dataclass(frozen=True)
class Stage:
    """A stage of training, from ``first_step`` (control steps of all robots together) on.

    Joints that are ``held`` stay in the default pose.
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
    weights=Weights(track_velocity=3.0, track_yaw_rate=1.5, lift=4.0, late_lift=-2.0),
    scales=RewardScales(step_s=0.36, longest_step_s=0.5),
)
"""Lifting a foot pays more than standing: with half these weights, two of three seeds stood."""

_STRIDE = replace(
    _STEP,
    weights=Weights(
        track_velocity=4.0,
        track_yaw_rate=2.0,
        alive=1.0,
        air_time=4.0,
        early_touchdown=-0.7,
        hasty_lift=-1.5,
        hard_touchdown=-0.1,
        high_foot=-15.0,
        hips=-0.6,
        fast_joints=-0.01,
    ),
    scales=replace(_STEP.scales, step_s=0.4, longest_step_s=0.6, lift_m=0.06, high_m=0.1),
)
"""The gait is learned early, on a level floor and with prompt observations: long steps, low feet
that touch down softly, double support in between, slow joints. Once it has settled, it is kept."""

_WIDE = replace(
    _STRIDE,
    commands=CommandRange(turning=0.1, standing=0.2),
    randomisation=Randomisation(push_m_s=0.25),
    weights=replace(
        _STRIDE.weights,
        track_velocity=5.0,
        track_yaw_rate=3.0,
        alive=2.0,
        stand=3.0,
        restless=-20.0,
        low_pelvis=-20.0,
        tilt=-4.0,
        torso=-0.6,
        early_touchdown=-1.0,
        hasty_lift=-3.0,
        hard_touchdown=-0.15,
        high_foot=-20.0,
        sway=-0.1,
        fast_joints=-0.02,
    ),
    scales=replace(
        _STRIDE.scales, vx_sd_m_s=0.4, wz_sd_rad_s=0.4, step_s=0.44, longest_step_s=0.62
    ),
)
"""Staying up pays: if costs outweighed the reward of a step, falling would be no loss."""

_NOISY = replace(
    _WIDE,
    commands=replace(_WIDE.commands, standing=0.25, jumping=0.1),
    randomisation=Randomisation(
        push_m_s=0.25,
        joint_offset_sd_rad=0.02,
        action_noise_sd=0.08,
        busy_arms=0.4,
        observation_delay_steps=(0, 2),
    ),
    weights=replace(
        _WIDE.weights,
        on_average=4.0,
        set_off=8.0,
        stand=6.0,
        restless=-60.0,
        hips=-1.0,
        torso=-1.2,
        impact=-0.001,
        action_jerk=-0.015,
        early_touchdown=-1.2,
        hasty_lift=-4.0,
        hard_touchdown=-0.2,
        high_foot=-25.0,
    ),
    scales=replace(
        _WIDE.scales, vx_sd_m_s=0.3, wz_sd_rad_s=0.3, step_s=0.47, longest_step_s=0.66, high_m=0.08
    ),
)
"""The disturbances by the chip, and commands and observations as on a robot."""

_LATE = replace(
    _NOISY,
    randomisation=replace(
        _NOISY.randomisation,
        push_m_s=0.3,
        observation_delay_steps=(0, 4),
        terrain=Terrain(rough=0.4, box_m=0.01),
    ),
    weights=replace(_NOISY.weights, fall=-400.0),
)
"""The ground is uneven from here on. In runs with uneven ground from 2 M steps on, robots still
fell often at the end (docs/lab/gait.md)."""

_BOXES = replace(
    _LATE,
    randomisation=replace(
        _LATE.randomisation,
        push_m_s=0.4,
        mass=(0.95, 1.15),
        terrain=Terrain(rough=0.5, box_m=0.02, slope_rad=0.05, relief_m=0.004),
        estimator=EstimatorErrors(odometry=0.25, scale=0.1, wander_m_s=0.03),
    ),
    scales=replace(_LATE.scales, vx_sd_m_s=0.25, wz_sd_rad_s=0.25),
)
_SLOPES = replace(
    _BOXES,
    commands=replace(_BOXES.commands, turning=0.15, still=0.05),
    randomisation=replace(
        _BOXES.randomisation,
        push_m_s=0.55,
        joint_offset_sd_rad=0.015,
        terrain=Terrain(rough=0.6, box_m=0.03, slope_rad=0.11, relief_m=0.008),
        estimator=EstimatorErrors(odometry=0.35, scale=0.1, wander_m_s=0.03),
    ),
    weights=replace(_BOXES.weights, fall=-800.0, tilt=-8.0, track_yaw_rate=4.0),
    scales=replace(_BOXES.scales, vx_sd_m_s=0.2),
)
_PRECISE = replace(
    _SLOPES,
    commands=replace(_SLOPES.commands, still=0.02),
    randomisation=replace(_SLOPES.randomisation, push_m_s=0.65),
    weights=replace(_SLOPES.weights, fall=-1200.0, track_yaw_rate=5.0),
    scales=replace(_SLOPES.scales, vx_sd_m_s=0.15, wz_sd_rad_s=0.2),
)
"""These widths come once errors of speed are within them: with larger errors, no change would earn
anything. Falls are rare by now; if they cost as little as before, they would become more frequent
again."""

_EXPLORE = replace(
    _PRECISE,
    commands=replace(_PRECISE.commands, standing=0.3, still=0.05),
    randomisation=replace(
        _PRECISE.randomisation,
        push_m_s=0.6,
        busy_arms=0.8,
        terrain=Terrain(rough=0.6, box_m=0.03, slope_rad=0.12, relief_m=0.01),
    ),
    weights=replace(_PRECISE.weights, fall=-800.0, stand=7.0, early_touchdown=-2.0),
    scales=replace(_PRECISE.scales, vx_sd_m_s=0.2, step_s=0.5, longest_step_s=0.7),
)
"""The entropy is five times that of any stage before: actions of hip roll, hip pitch and knees vary
by only 0.08 to 0.14 by then, which changes steps too little to learn how to react to a push."""

_SHOVED = replace(
    _EXPLORE,
    randomisation=replace(
        _EXPLORE.randomisation,
        push_m_s=0.9,
        push_every_s=3.0,
        terrain=replace(_EXPLORE.randomisation.terrain, slope_rad=0.19),
    ),
)
"""Pushes reach 1.3 m/s: with 0.6 along each axis, few were as hard as the 0.8 m/s that a policy
must survive, and pushes of 0.8 m/s made a fifth of the robots fall; with 0.8 along each axis every
5 s, 0 to 21 of a hundred fell (docs/training.md). Slopes reach 11 degrees: with up to 7 degrees,
few were as steep as the 6 degrees that a policy must walk on, and with up to 9, 4 of a hundred
fell."""

_FIRM = replace(
    _SHOVED,
    weights=replace(
        _SHOVED.weights, fall=-1200.0, early_touchdown=-3.0, high_foot=-60.0, fast_joints=-0.03
    ),
    scales=replace(_SHOVED.scales, vx_sd_m_s=0.15, clearance_m=0.05, high_m=0.06),
)
"""Low feet: heights above 6 cm cost, and heights below 5 cm instead of 8 cm. With costs above and
below 8 cm, feet rose to 8.9 cm. Short steps cost more: with a weight of -2, robots took 2.6 steps a
second."""
_LAST = replace(
    _FIRM,
    commands=replace(_FIRM.commands, still=0.02),
    weights=replace(
        _FIRM.weights, fall=-1500.0, track_velocity=6.0, track_yaw_rate=6.0, fast_joints=-0.04
    ),
    scales=replace(_FIRM.scales, vx_sd_m_s=0.12, wz_sd_rad_s=0.18),
)
_EXACT = replace(
    _LAST,
    commands=replace(_LAST.commands, standing=0.25),
    randomisation=replace(_LAST.randomisation, action_noise_sd=0.05),
    weights=replace(_LAST.weights, track_velocity=8.0, track_yaw_rate=8.0, on_average=10.0),
    scales=replace(_LAST.scales, vx_sd_m_s=0.1, wz_sd_rad_s=0.14),
)
"""Exploration makes speeds less exact, and exact speeds pay more now."""

_HELD = tuple(name for name in JOINTS if "shoulder" in name or "elbow" in name or name == "torso")
"""Joints that are held: the effect of their actions is lost in the noise of the rewards."""

_SPIKES = HiddenNoise(white=0.03, lasting=0.03)

STAGES = (
    Stage("step", 0, _STEP, entropy=0.001),
    Stage("stride", 2_000_000, _STRIDE, entropy=0.001),
    Stage("wide", 4_000_000, _WIDE, entropy=0.001, held=_HELD),
    Stage("noisy", 7_000_000, _NOISY, 0.001, _SPIKES, held=_HELD),
    Stage("late", 10_000_000, _LATE, 0.0007, _SPIKES, held=_HELD),
    Stage("boxes", 12_500_000, _BOXES, 0.0005, _SPIKES, held=_HELD),
    Stage("slopes", 15_500_000, _SLOPES, 0.0003, _SPIKES, held=_HELD),
    Stage("precise", 19_000_000, _PRECISE, 0.0, _SPIKES, held=_HELD),
    Stage("explore", 23_300_000, _EXPLORE, 0.005, _SPIKES, held=_HELD),
    Stage("shoved", 27_000_000, _SHOVED, 0.004, _SPIKES, held=_HELD),
    Stage("firm", 32_000_000, _FIRM, 0.002, _SPIKES, held=_HELD),
    Stage("last", 36_000_000, _LAST, 0.0005, _SPIKES, held=_HELD),
    Stage("exact", 40_000_000, _EXACT, 0.0, _SPIKES, held=_HELD),
)
"""In order; sources of the figures: see `spikeport.training.rewards`."""


def without_hidden_noise(stages: tuple[Stage, ...] = STAGES) -> tuple[Stage, ...]:
    """Return the stages without noise on hidden units, for a policy that is not made for spikes."""
    return tuple(replace(stage, hidden_noise=HiddenNoise()) for stage in stages)


def stage_at(step: int, stages: tuple[Stage, ...] = STAGES) -> Stage:
    """Return the stage that a control step belongs to."""
    return [stage for stage in stages if stage.first_step <= step][-1]
