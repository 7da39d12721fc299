"""The figures of an episode: falls, tracking, margins of the joints, and gait."""

from typing import NamedTuple

import numpy as np

from spikeport.experiments.evaluate.stage import EpisodeRecording, Stage
from spikeport.experiments.walk.metrics import smoothed
from spikeport.robot.feet import POINTS, SIDES
from spikeport.robot.foot_sensors import FootReadings, readings
from spikeport.robot.link.h1 import SPEED_LIMITS_RAD_S
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.times import ROUNDING_S
from spikeport.training.motion import Motion, rotations

BEFORE_FALL_S = 1.0
"""The last time before a fall, in which only the fall itself is counted."""
SHORTEST_S = 3.0
"""The least time of walking before that; with less, the figures are None."""
SETTLING_S = 1.0
"""The time after a change of command in which no error is counted."""
CONTACT_N = 1.0
IMPACT_S = 0.05
SHORTEST_SWING_S = 0.05
"""The least time in the air for a step: a foot that slips or bounces leaves the floor for less."""
MOVING = 0.2
"""The least command to move, in m/s and rad/s: with smaller ones a robot may stand."""
SHORTEST_M = 1.0
"""The shortest way ahead for which an episode has a cost of transport."""


class Measure(NamedTuple):
    """A figure of an episode: its heading in a table, and its definition."""

    heading: str
    definition: str


MEASURES = {
    "speed_error_m_s": Measure(
        "speed error, m/s", "mean |command - speed along the heading|, both smoothed over 0.2 s"
    ),
    "yaw_rate_error_rad_s": Measure(
        "yaw rate error, rad/s", "mean |command - yaw rate|, both smoothed over 0.2 s"
    ),
    "torque_use": Measure(
        "torque, of limit", "99th percentile over time, of the joint with the largest"
    ),
    "speed_use": Measure(
        "joint speed, of limit",
        "largest speed of a joint, as a share of its motor's limit in Unitree's h1.urdf",
    ),
    "joint_margin_rad": Measure(
        "to joint stops, rad", "least distance of a joint from its stops, negative beyond"
    ),
    "clearance_m": Measure(
        "clearance, m", "mean height of the lower of heel and toe at the top of a step"
    ),
    "double_support": Measure(
        "double support", "share of the time on both feet, while the robot is commanded to move"
    ),
    "steps_per_s": Measure(
        "steps/s",
        "touch-downs a second after 50 ms in the air or more, while the robot is commanded to move",
    ),
    "slip_m_s": Measure(
        "slip, m/s",
        "mean speed of the centre of the lower of heel and toe along the floor, weighted by the "
        "foot's load",
    ),
    "impact_bw": Measure(
        "impact, body weights", "mean of the largest force within 50 ms of a touch-down"
    ),
    "cost_of_transport": Measure(
        "cost of transport",
        "positive work of the joints, divided by weight and distance, while the robot is commanded "
        "to move ahead",
    ),
}
"""The figures of an episode, other than its fall."""


def measure(stage: Stage) -> dict[str, float | int | None]:
    """Return the figures of an episode that is over."""
    recording = stage.witness.recording()
    fallen_at_s = stage.legs.fallen_at_s
    figures: dict[str, float | int | None] = {
        "falls": int(fallen_at_s is not None),
        "fallen_at_s": fallen_at_s,
        **dict.fromkeys(MEASURES),
    }
    # A falling robot swings its joints and feet as no walking robot does.
    end_s = np.inf if fallen_at_s is None else fallen_at_s - BEFORE_FALL_S
    walked = recording.where(recording.time_s < end_s)
    if len(walked.time_s) and walked.time_s[-1] >= SHORTEST_S - ROUNDING_S:
        figures |= _tracking(stage, walked) | _margins(stage.plant, walked)
        figures |= _gait(stage.plant, walked)
    return figures


def _tracking(stage: Stage, walked: EpisodeRecording) -> dict[str, float]:
    motion = Motion.from_states(walked.qpos, walked.qvel)
    moved = np.stack((motion.level_velocity[:, 0], motion.yaw_rate), axis=1)
    errors = np.abs(smoothed(walked.command[:, [0, 2]] - moved))
    settled = stage.commands.age_s(walked.time_s) > SETTLING_S
    speed, yaw_rate = errors[settled].mean(axis=0).tolist()
    return {"speed_error_m_s": speed, "yaw_rate_error_rad_s": yaw_rate}


def _margins(plant: PerturbedPlant, walked: EpisodeRecording) -> dict[str, float]:
    model, q = plant.model, walked.qpos[:, 7:]
    # Joint 0 is the free one of the pelvis, which has no stops.
    low, high = model.jnt_range[1:].T
    torque = np.abs(walked.torque_nm) / model.actuator_forcerange[:, 1]
    speed = np.abs(walked.qvel[:, 6:]) / SPEED_LIMITS_RAD_S
    return {
        "torque_use": float(np.quantile(torque, 0.99, axis=0).max()),
        "speed_use": float(speed.max()),
        "joint_margin_rad": float(np.minimum(q - low, high - q).min()),
    }


def _gait(plant: PerturbedPlant, walked: EpisodeRecording) -> dict[str, float | None]:
    """Return the figures of feet and work; figures without a step or a way to measure are None."""
    dt_s = float(walked.time_s[1] - walked.time_s[0])
    moves = (np.abs(walked.command) > MOVING).any(axis=1)
    feet = readings(walked.feet)
    force_n = feet.force_n
    down = force_n > CONTACT_N
    height_m, speed_m_s = _soles(plant, feet)
    shortest = round(SHORTEST_SWING_S / dt_s)
    feet_rows = zip(down.T, height_m.T, force_n.T, strict=True)
    steps = [_Steps(*columns, shortest) for columns in feet_rows]
    begun = np.concatenate([one.down_at for one in steps])
    peaks = np.concatenate([one.peaks(round(IMPACT_S / dt_s)) for one in steps])
    tops = np.concatenate([one.tops() for one in steps])
    weight_n = plant.model.body_mass.sum() * -plant.model.opt.gravity[2]
    moving_s = np.count_nonzero(moves) * dt_s
    return {
        "clearance_m": float(tops.mean()) if len(tops) else None,
        "double_support": float(down[moves].all(axis=1).mean()) if moving_s else None,
        "steps_per_s": float(moves[begun].sum() / moving_s) if moving_s else None,
        "slip_m_s": _slip_m_s(force_n, speed_m_s),
        "impact_bw": float(peaks.mean() / weight_n) if len(peaks) else None,
        "cost_of_transport": _cost_of_transport(walked, weight_n, dt_s),
    }


def _during(values: np.ndarray) -> np.ndarray:
    """Return the means (n - 1, ...) of values over the steps that end with rows 1 to n - 1.

    A row's forces and torques acted during the step that ends with it.
    """
    return np.asarray((values[:-1] + values[1:]) / 2)


def _slip_m_s(force_n: np.ndarray, speed_m_s: np.ndarray) -> float | None:
    """Return the mean speed of feet (n, 2), weighted by their loads; None without a load.

    MuJoCo's integrator moves a body by its speed at the end of a step: as a foot touches down, its
    speed in the air moves it no more.
    """
    load_n = force_n[1:]
    return float((load_n * speed_m_s[1:]).sum() / load_n.sum()) if load_n.any() else None


def _cost_of_transport(walked: EpisodeRecording, weight_n: float, dt_s: float) -> float | None:
    """Return the work for a weight and a distance while moving ahead; None after a short way."""
    # Braking returns no energy: negative work counts as zero.
    work_w = np.maximum(walked.torque_nm[1:] * _during(walked.qvel[:, 6:]), 0).sum(axis=1)
    speed_m_s = np.linalg.norm(_during(walked.qvel[:, :2]), axis=1)
    ahead = walked.command[1:, 0] > MOVING
    way_m = speed_m_s[ahead].sum() * dt_s
    if way_m < SHORTEST_M:
        return None
    return float(work_w[ahead].sum() * dt_s / (weight_n * way_m))


def _soles(plant: PerturbedPlant, feet: FootReadings) -> tuple[np.ndarray, np.ndarray]:
    """Return heights (n, 2) above the floor, and speeds, of the lower of heel and toe."""
    places = feet.points
    radii = np.reshape([plant.model.geom(name).size[0] for name in POINTS], (len(SIDES), -1))
    heights = places[..., 2] - radii - _ends_below_m(plant, places)
    heights -= plant.floor.height_m(places[..., 0], places[..., 1])
    speeds = np.linalg.norm(feet.velocities[..., :2], axis=-1)
    # The lower one bears the load: its height is the clearance, its speed the slip.
    lower = heights.argmin(axis=2)[..., None]
    height, speed = (np.take_along_axis(each, lower, axis=2)[..., 0] for each in (heights, speeds))
    return height, speed


def _ends_below_m(plant: PerturbedPlant, places: np.ndarray) -> np.ndarray:
    """Return how far heel and toe (n, 2, 2) have an end below their centre, on feet without roll.

    Menagerie's heels are capsules along the foot; our heels are spheres.
    """
    geoms = [plant.model.geom(name) for name in POINTS]
    pos = np.reshape([geom.pos for geom in geoms], places.shape[1:])
    # A capsule lies along its own z axis; its second size is half of its length, 0 for a sphere.
    half = [geom.size[1] * rotations(geom.quat[None])[0, :, 2] for geom in geoms]
    half_x, _, half_z = np.moveaxis(np.reshape(half, pos.shape), -1, 0)
    # The halves along the line from heel to toe and across it, in the plane of the foot; with the
    # sine of the line's pitch, the vertical part of their sum follows.
    x, _, z = np.moveaxis(_along(pos), -1, 0)[..., None]
    rise = _along(places)[..., 2:]
    ahead, up = x * half_x + z * half_z, x * half_z - z * half_x
    return np.asarray(np.abs(ahead * rise + up * np.sqrt(1 - rise**2)))


def _along(points: np.ndarray) -> np.ndarray:
    """Return unit vectors (..., 3) from heels to toes, from points (..., 2, 3)."""
    line = points[..., 1, :] - points[..., 0, :]
    return np.asarray(line / np.linalg.norm(line, axis=-1, keepdims=True))


class _Steps:
    """The steps of a foot, from its contact with the floor (n,), its heights and its forces.

    Times in the air of fewer than ``shortest`` rows are no steps.
    """

    def __init__(
        self, down: np.ndarray, height_m: np.ndarray, force_n: np.ndarray, shortest: int
    ) -> None:
        changes = np.diff(down.astype(int))
        down_at, up_at = (np.flatnonzero(changes == sign) + 1 for sign in (1, -1))
        # The number of the touch-down after each lift-off; the last swing may not end.
        ends = np.searchsorted(down_at, up_at)
        short = np.append(down_at, np.inf)[ends] - up_at < shortest
        no_steps = ends[short]
        # A reset leaves a foot some mm above the floor: its first contact ends no step either.
        if len(down_at) and not down[0] and down_at[0] < shortest:
            no_steps = np.append(no_steps, 0)
        self.down_at, self._up_at = np.delete(down_at, no_steps), up_at[~short]
        self._height_m, self._force_n = height_m, force_n

    def peaks(self, n_after: int) -> np.ndarray:
        """Return the largest force after each touch-down."""
        return np.array([self._force_n[at : at + n_after].max() for at in self.down_at])

    def tops(self) -> np.ndarray:
        """Return the highest point of each complete swing."""
        # The number of the lift-off before each touch-down; -1 if the foot started in the air.
        begun = np.searchsorted(self._up_at, self.down_at, side="left") - 1
        whole = zip(self.down_at[begun >= 0], self._up_at[begun[begun >= 0]], strict=True)
        return np.array([self._height_m[up:down].max() for down, up in whole])
