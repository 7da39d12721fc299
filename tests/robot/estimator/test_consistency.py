"""The consistency of the filter: errors of zero mean, as large as its covariance says.

The simulated world is the one that the filter assumes: an IMU with white noise and biases, and two
feet that stand by turns and are measured with noise.
"""

import numpy as np
import pytest

from spikeport.robot.estimator import footholds
from spikeport.robot.estimator.belief import (
    ACCELEROMETER_BIAS,
    FIRST_CONTACT,
    GYROSCOPE_BIAS,
    N_ERRORS,
    N_VECTORS,
    PLACE,
    ROTATION,
    VELOCITY,
    Belief,
    corrected,
    errors_of,
)
from spikeport.robot.estimator.footholds import Points
from spikeport.robot.estimator.group import Pose
from spikeport.robot.estimator.propagation import FREE_FALL_M_S2, ImuNoise, moved, propagated
from tests.helpers.beliefs import difference, moved_by

RUNS, STEPS, DT_S = 60, 120, 0.005
NOISE = ImuNoise(0.01, 0.1, 1e-3, 1e-2, slip=0.01, sinking=0.02)
SEEN_M = 0.002
MOTION = [ROTATION, errors_of(VELOCITY), errors_of(PLACE), GYROSCOPE_BIAS, ACCELEROMETER_BIAS]
MOTION = np.concatenate([np.arange(N_ERRORS)[part] for part in MOTION])
HOLDS = 40
"""Steps for which a foot stands."""


def first_belief() -> Belief:
    deviations = np.zeros(N_ERRORS)
    deviations[ROTATION] = 0.03
    deviations[errors_of(VELOCITY)], deviations[errors_of(PLACE)] = 0.1, 0.05
    deviations[GYROSCOPE_BIAS], deviations[ACCELEROMETER_BIAS] = 0.01, 0.05
    pose = Pose(np.eye(3), np.zeros((N_VECTORS, 3)))
    return Belief(pose, np.zeros(3), np.zeros(3), np.diag(deviations**2))


class World:
    """The truth, and a filter that knows only the statistics of the truth."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.RandomState(seed)
        self.belief = first_belief()
        error = np.sqrt(np.diag(self.belief.covariance)) * self.rng.standard_normal(N_ERRORS)
        self.true = moved_by(self.belief, -error)
        self.standing = np.zeros(4, dtype=bool)

    def step(self, step: int) -> None:
        self.move(step)
        standing = np.arange(4) // 2 == step // HOLDS % 2
        stayed, new = standing & self.standing, standing & ~self.standing
        self._land(new)
        self.belief = footholds.forgotten(self.belief, self.standing & ~standing)
        points = self._points()
        if stayed.any():
            seen = footholds.standing_still(self.belief, points, stayed)
            self.belief = corrected(self.belief, seen)
        self.belief = footholds.added(self.belief, points, new)
        self.standing = standing

    def _white(self, density: float, size: int = 3) -> np.ndarray:
        return density / np.sqrt(DT_S) * self.rng.standard_normal(size)

    def move(self, step: int) -> None:
        """Sway the robot; its IMU and contacts err by the noise that the filter assumes."""
        true, time_s = self.true, step * DT_S
        omega = np.array([np.sin(6 * time_s), np.cos(5 * time_s), 0.5])
        push = np.array([np.cos(7 * time_s), np.sin(8 * time_s), np.cos(9 * time_s)])
        force = true.pose.rotation.T @ (push - FREE_FALL_M_S2)
        gyroscope = omega + true.gyroscope_bias + self._white(NOISE.gyroscope)
        accelerometer = force + true.accelerometer_bias + self._white(NOISE.accelerometer)
        vectors = moved(true.pose, omega, force, DT_S)
        slips = self._white(1.0, 12).reshape(4, 3) * (NOISE.slip, NOISE.slip, NOISE.sinking)
        vectors.vectors[FIRST_CONTACT:] += DT_S * slips * self.standing[:, None]
        self.true = Belief(
            vectors,
            true.gyroscope_bias + DT_S * self._white(NOISE.gyroscope_walk),
            true.accelerometer_bias + DT_S * self._white(NOISE.accelerometer_walk),
            true.covariance,
        )
        imu = gyroscope, accelerometer
        self.belief = propagated(self.belief, *imu, self.standing, DT_S, NOISE)

    def _land(self, new: np.ndarray) -> None:
        """Put feet down around the robot, 0.8 m below."""
        vectors = self.true.pose.vectors
        for contact in np.flatnonzero(new):
            apart = np.append(0.2 * self.rng.standard_normal(2), -0.8)
            vectors[FIRST_CONTACT + contact] = vectors[PLACE] + apart

    def _points(self) -> Points:
        rotation, vectors = self.true.pose
        places = (vectors[FIRST_CONTACT:] - vectors[PLACE]) @ rotation
        noise = SEEN_M * self.rng.standard_normal((4, 3))
        return Points(places + noise, np.tile(SEEN_M**2 * np.eye(3), (4, 1, 1)))


@pytest.fixture(scope="module")
def ends() -> list[World]:
    worlds = [World(seed) for seed in range(RUNS)]
    for world in worlds:
        for step in range(STEPS):
            world.step(step)
    return worlds


@pytest.mark.slow
def test_errors_have_zero_mean(ends):
    errors = np.array([difference(world.belief, world.true)[MOTION] for world in ends])
    expected = np.sqrt([np.diag(world.belief.covariance)[MOTION] for world in ends])
    means = (errors / expected).mean(axis=0) * np.sqrt(RUNS)
    assert np.abs(means).max() < 4  # 15 normal variates exceed it once in 1,000 sets


def test_errors_are_as_large_as_the_filter_says(ends):
    """xi^T P^-1 xi has a mean of 15, the number of errors: it is a chi-squared variate."""
    squares = []
    for world in ends:
        error = difference(world.belief, world.true)[MOTION]
        covariance = world.belief.covariance[np.ix_(MOTION, MOTION)]
        squares.append(error @ np.linalg.solve(covariance, error))
    n = len(MOTION)
    assert abs(np.mean(squares) - n) < 4 * np.sqrt(2 * n / RUNS)


def test_standing_feet_reveal_velocity_and_tilt_but_not_place_and_heading(ends):
    """Compared with the start; without feet, nothing is known better than then."""
    flies = World(0)
    for step in range(STEPS):
        flies.move(step)
    start, *ends = (
        np.sqrt(np.diag(belief.covariance))
        for belief in (first_belief(), ends[0].belief, flies.belief)
    )
    feet, none = (end[MOTION] / start[MOTION] for end in ends)
    tilt, heading, velocity, place = slice(2), 2, slice(3, 6), slice(6, 8)
    assert (feet[tilt] < 0.7).all()
    assert (feet[velocity] < 0.5).all()
    assert feet[heading] >= 1.0
    assert (feet[place] >= 1.0).all()
    assert (none >= 1.0).all()
