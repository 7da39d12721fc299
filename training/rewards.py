"""The rewards of walking: each term a function of a step, each weight a figure per second.

    reward = dt sum_k weight_k term_k

Each term is ``(n,)`` for n robots, in SI units. Terms whose weight is negative are costs. Sources:
Isaac Lab's ``Isaac-Velocity-Flat-H1``; the terms of stepping are this project's own.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from spikeport.arrays import Flags, Floats
from spikeport.robot.description import JOINTS
from spikeport.robot.link.h1 import SPEED_LIMITS_RAD_S
from spikeport.robot.walk_interface import CONTROL_DT_S, POSE_RAD
from spikeport.training.gait import Gait
from spikeport.training.motion import FeetMotion, Motion


@dataclass(frozen=True)
class RewardScales:
    """The scales within the terms.

    Attributes
    ----------
    vx_sd_m_s, wz_sd_rad_s : float
        Errors of speed and yaw rate at which `track_velocity` and `track_yaw_rate` fall to 1/e.
    drift_m_s, drift_rad_s : float
        Drifts at which `on_average` falls to 1/e.
    set_off_s, sideways_m_s : float
        Time for which `set_off` counts, and the drift to a side at which it falls to 1/e.
    step_s, longest_step_s : float
        Time in the air up to which `air_time` pays and `early_touchdown` costs, and the time beyond
        which `long_air` costs.
    double_support_s : float
        Time on both feet below which `hasty_lift` costs.
    lift_every_s : float
        Time since a foot was lifted beyond which `late_lift` costs.
    lift_m : float
        Height at which `lift` pays in full.
    clearance_m, high_m : float
        Height of a moving foot below which `clearance`, and beyond which `high_foot` costs; feet
        on the floor count, too.
    pelvis_m : float
        Height of the pelvis below which `low_pelvis` costs.
    impact_n : float
        Force on a foot beyond which `impact` costs, N.
    """

    vx_sd_m_s: float = 0.5
    wz_sd_rad_s: float = 0.5
    drift_m_s: float = 0.1
    drift_rad_s: float = 0.15
    set_off_s: float = 2.0
    sideways_m_s: float = 0.05
    step_s: float = 0.42
    longest_step_s: float = 0.55
    double_support_s: float = 0.08
    lift_every_s: float = 0.8
    lift_m: float = 0.10
    clearance_m: float = 0.08
    high_m: float = 0.16
    pelvis_m: float = 0.95
    impact_n: float = 700.0


@dataclass(frozen=True)
class Step:
    """The quantities that a reward may depend on, for n robots.

    ``pelvis_m (n,)`` is the height of the pelvis above the ground, ``even (n,)`` is True on level,
    even ground, ``feet_before`` are the feet a step ago;
    ``command (n, 3)`` are the commands, ``moving (n,)`` is True for robots that are asked to move,
    and ``moving_s (n,)`` is the time since then;
    ``velocity (n, 2)`` and ``yaw_rate (n,)`` are smoothed; ``drift (n, 3)`` is command less speed,
    on average over a step and more; ``actions`` are the last three, the newest first, each
    ``(n, 19)``.
    """

    motion: Motion
    feet: FeetMotion
    feet_before: FeetMotion
    pelvis_m: Floats
    even: Flags
    gait: Gait
    command: Floats
    moving: Flags
    moving_s: Floats
    velocity: Floats
    yaw_rate: Floats
    drift: Floats
    actions: tuple[Floats, Floats, Floats]
    joint_acceleration: Floats
    torque_nm: Floats
    fallen: Flags
    scales: RewardScales

    @property
    def single_support(self) -> Flags:
        """The robots that are asked to move and have one foot on the floor, ``(n,)``."""
        on_one: Flags = self.feet.contact.sum(axis=1) == 1
        return self.moving & on_one


def _of(*endings: str) -> list[int]:
    return [i for i, joint in enumerate(JOINTS) if joint.endswith(endings)]


_HIPS = _of("hip_yaw", "hip_roll")
_TORSO = _of("torso")
_SHOULDERS = _of("shoulder_roll", "shoulder_yaw")
_SWINGING = _of("shoulder_pitch", "elbow")
_ANKLES = _of("ankle")
_ANKLE_LIMITS_RAD = (-0.80, 0.45)
_LEGS = _of("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle")
_BRISK_RAD_S = 0.8 * SPEED_LIMITS_RAD_S[_LEGS]


def _sum(x: Floats) -> Floats:
    """Return the sum over feet or joints."""
    total: Floats = x.sum(axis=1)
    return total


def _squares(x: Floats) -> Floats:
    total: Floats = np.einsum("ni,ni->n", x, x)
    return total


def _deviation(s: Step, joints: list[int]) -> Floats:
    return _sum(np.abs(s.motion.q[:, joints] - POSE_RAD[joints]))


def track_velocity(s: Step) -> Floats:
    """Return exp(-|v* - v|^2 / sd^2)."""
    return np.exp(-_squares(s.command[:, :2] - s.velocity) / s.scales.vx_sd_m_s**2)


def track_yaw_rate(s: Step) -> Floats:
    """Return exp(-(wz* - wz)^2 / sd^2)."""
    return np.exp(-(((s.command[:, 2] - s.yaw_rate) / s.scales.wz_sd_rad_s) ** 2))


def on_average(s: Step) -> Floats:
    """Return exp(-|drift / scale|): speeds sway with every step, but are to be right on average."""
    scale = s.scales.drift_m_s, s.scales.drift_m_s, s.scales.drift_rad_s
    return np.exp(-np.sqrt(_squares(s.drift / scale)))


def set_off(s: Step) -> Floats:
    """Return exp(-|(vy, wz) drift / scale|) in the first ``set_off_s`` of a command to move.

    Feet are closer together in walking than in standing. A robot that begins by putting one foot
    next to the foot that bears it has moved to a side.
    """
    sideways = s.drift[:, 1:] / (s.scales.sideways_m_s, s.scales.drift_rad_s)
    return np.exp(-np.sqrt(_squares(sideways))) * (s.moving & (s.moving_s < s.scales.set_off_s))


def alive(s: Step) -> Floats:
    """Return 1 while the robot has not fallen."""
    return (~s.fallen).astype(float)


def fall(s: Step) -> Floats:
    """Return 1 in the step in which the robot falls."""
    return s.fallen.astype(float)


def air_time(s: Step) -> Floats:
    """Return the shorter of the times of one foot up and the other down, up to ``step_s``."""
    both: Floats = np.minimum(s.gait.air_s.max(axis=1), s.gait.contact_s.max(axis=1))
    return np.minimum(both, s.scales.step_s) * s.single_support


def lift(s: Step) -> Floats:
    """Return the height of the foot in the air as a share of ``lift_m``, up to 1, on one foot."""
    height: Floats = s.feet.height_m.max(axis=1) / s.scales.lift_m
    return np.clip(height, 0.0, 1.0) * s.single_support


def late_lift(s: Step) -> Floats:
    """Return the time beyond ``lift_every_s`` since each foot was lifted, up to 1 s each."""
    late = np.clip(s.gait.since_lift_s - s.scales.lift_every_s, 0.0, 1.0)
    return _sum(late) * s.moving


def long_air(s: Step) -> Floats:
    """Return 1 with a foot up longer than ``longest_step_s``."""
    return (s.gait.air_s > s.scales.longest_step_s).any(axis=1).astype(float)


def early_touchdown(s: Step) -> Floats:
    """Return ``step_s`` less the time in the air, as a foot comes down too early, per second."""
    early = np.clip(s.scales.step_s - s.gait.last_air_s, 0.0, None) * s.gait.touched_down
    # An event lasts one control step. Divided by this time, its weight is a figure per second, as
    # for all terms.
    return _sum(early) * s.moving / CONTROL_DT_S


def hasty_lift(s: Step) -> Floats:
    """Return ``double_support_s`` less the time on both feet, as one lifts early, per second."""
    missing = np.clip(s.scales.double_support_s - s.gait.both_s, 0.0, None)
    return missing * s.gait.lifted.any(axis=1) * s.moving / CONTROL_DT_S


def hard_touchdown(s: Step) -> Floats:
    """Return the downward speed of a foot before it came down, squared, per second."""
    falling = np.clip(-s.feet_before.velocity[..., 2], 0.0, None)
    return _sum(falling**2 * s.gait.touched_down) / CONTROL_DT_S


def clearance(s: Step) -> Floats:
    """Return the missing height squared times speed of each foot, m^3/s."""
    missing = np.clip(s.scales.clearance_m - s.feet.height_m, 0.0, None) ** 2
    speed = np.linalg.norm(s.feet.velocity[..., :2], axis=-1)
    return _sum(missing * speed)


def high_foot(s: Step) -> Floats:
    """Return the heights of the feet beyond ``high_m``, added up."""
    return _sum(np.clip(s.feet.height_m - s.scales.high_m, 0.0, None))


def slide(s: Step) -> Floats:
    """Return the horizontal speed of the feet on the floor."""
    return _sum(np.linalg.norm(s.feet.velocity[..., :2], axis=-1) * s.feet.contact)


def flight(s: Step) -> Floats:
    """Return 1 with both feet in the air."""
    return (~s.feet.contact.any(axis=1)).astype(float)


def impact(s: Step) -> Floats:
    """Return the contact force of each foot beyond ``impact_n``, up to 1,000 N."""
    return _sum(np.clip(s.feet.force_n - s.scales.impact_n, 0.0, 1000.0))


def stand(s: Step) -> Floats:
    """Return 1 with both feet on the floor, if asked to stand on even ground."""
    return (~s.moving & s.even & s.feet.contact.all(axis=1)).astype(float)


def restless(s: Step) -> Floats:
    """Return the heights of the feet, added up, if asked to stand on even ground.

    Ankles of 40 N m hardly balance a robot on a slope, so steps cost nothing there.
    """
    return _sum(s.feet.height_m.clip(min=0.0)) * (~s.moving & s.even)


def low_pelvis(s: Step) -> Floats:
    """Return how far the pelvis is below ``pelvis_m``."""
    return np.clip(s.scales.pelvis_m - s.pelvis_m, 0.0, None)


def tilt(s: Step) -> Floats:
    """Return the horizontal part of gravity in the pelvis frame, squared."""
    return _squares(s.motion.gravity[:, :2])


def sway(s: Step) -> Floats:
    """Return the angular velocity about the horizontal axes, squared."""
    return _squares(s.motion.turn_rate[:, :2])


def bounce(s: Step) -> Floats:
    """Return the vertical velocity, squared."""
    return s.motion.level_velocity[:, 2] ** 2


def hips(s: Step) -> Floats:
    """Return how far the hips' yaw and roll are from the default pose."""
    return _deviation(s, _HIPS)


def torso(s: Step) -> Floats:
    """Return the size of the torso's turn from the default pose."""
    return _deviation(s, _TORSO)


def swinging_arms(s: Step) -> Floats:
    """Return how far shoulders' pitch and elbows are from the default pose."""
    return _deviation(s, _SWINGING)


def spread_arms(s: Step) -> Floats:
    """Return how far shoulders' roll and yaw are from the default pose."""
    return _deviation(s, _SHOULDERS)


def ankle_limits(s: Step) -> Floats:
    """Return how far the ankles are beyond nine tenths of their range."""
    q = s.motion.q[:, _ANKLES]
    return _sum(np.abs(q - np.clip(q, *_ANKLE_LIMITS_RAD)))


def acceleration(s: Step) -> Floats:
    """Return the joint accelerations, squared."""
    return _squares(s.joint_acceleration)


def fast_joints(s: Step) -> Floats:
    """Return the speed of leg joints beyond eight tenths of the motors' limits, squared."""
    return _squares(np.clip(np.abs(s.motion.dq[:, _LEGS]) - _BRISK_RAD_S, 0.0, None))


def torque(s: Step) -> Floats:
    """Return the joint torques, squared."""
    return _squares(s.torque_nm)


def action_rate(s: Step) -> Floats:
    """Return the change of the action, squared."""
    return _squares(s.actions[0] - s.actions[1])


def action_jerk(s: Step) -> Floats:
    """Return the second difference of the action, squared."""
    newest, last, oldest = s.actions
    return _squares(newest - 2 * last + oldest)


@dataclass(frozen=True)
class Weights:
    """Weight of every term, per second; the fields are the terms' names."""

    track_velocity: float = 1.5
    track_yaw_rate: float = 1.0
    on_average: float = 0.0
    set_off: float = 0.0
    alive: float = 0.25
    fall: float = -200.0
    air_time: float = 1.5
    lift: float = 2.0
    late_lift: float = -1.0
    long_air: float = -1.0
    early_touchdown: float = -0.1
    hasty_lift: float = 0.0
    hard_touchdown: float = 0.0
    clearance: float = -20.0
    high_foot: float = -3.0
    slide: float = -0.25
    flight: float = -0.5
    impact: float = -0.002
    stand: float = 0.0
    restless: float = 0.0
    low_pelvis: float = -5.0
    tilt: float = -1.0
    sway: float = -0.05
    bounce: float = -0.2
    hips: float = -0.2
    torso: float = -0.1
    swinging_arms: float = -0.2
    spread_arms: float = -0.3
    ankle_limits: float = -1.0
    fast_joints: float = 0.0
    acceleration: float = -5e-7
    torque: float = -1e-5
    action_rate: float = -0.02
    action_jerk: float = -0.005


TERMS: dict[str, Callable[[Step], Floats]] = {
    field.name: globals()[field.name] for field in fields(Weights)
}


def reward(s: Step, weights: Weights) -> dict[str, Floats]:
    """Return the reward of every term that counts, ``(n,)`` each."""
    weight = {name: getattr(weights, name) for name in TERMS}
    return {n: CONTROL_DT_S * weight[n] * TERMS[n](s) for n in TERMS if weight[n] != 0.0}
