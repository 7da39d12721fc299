"""Uneven ground, and the planes that stand for it."""

import numpy as np
import pytest

from spikeport.robot.engine import mujoco
from spikeport.training import model
from spikeport.training.terrain import Ground, Planes, Terrain

ALL = np.ones(200, bool)


def drawn(terrain, seed=0):
    ground = Ground(200, np.random.default_rng(seed))
    ground.draw(ALL, terrain)
    return ground


def heights(ground, *xy):
    return ground.height_m(np.tile(np.array(xy), (200, 1, 1)))


def test_ground_is_level_except_for_the_rough_share_of_robots():
    assert not heights(drawn(Terrain()), (0.0, 0.0), (3.0, -4.0)).any()
    steep = drawn(Terrain(rough=0.5, slope_rad=0.1))
    level = ~heights(steep, (5.0, 5.0)).any(axis=1)
    assert 0.4 < level.mean() < 0.6
    np.testing.assert_array_equal(steep.even, level)


def test_slopes_are_no_steeper_than_asked_for():
    low, high = heights(drawn(Terrain(rough=1.0, slope_rad=0.1)), (1.0, 0.0), (0.0, 1.0)).T
    steepness = np.arctan(np.hypot(low, high))
    assert 0.08 < steepness.max() <= 0.1


def test_boxes_are_level_and_no_higher_than_asked_for():
    ground = drawn(Terrain(rough=1.0, box_m=0.03, square_m=(0.5, 0.5)))
    one, same, other = heights(ground, (0.1, 0.1), (0.4, 0.4), (0.6, 0.4)).T
    np.testing.assert_array_equal(one, same)
    assert (one != other).mean() > 0.9
    assert 0 <= one.min() < one.max() <= 0.03


def test_waves_rise_to_their_height():
    ground = drawn(Terrain(rough=1.0, relief_m=0.02))
    line = np.stack((np.linspace(0, 20, 500), np.zeros(500)), axis=1)
    height = ground.height_m(np.tile(line, (200, 1, 1)))
    assert 0.015 < height.max() <= 0.02


def test_waves_have_their_length():
    """The Laplacian of a wave of length L is -(2 pi / L)^2 times its height."""
    ground = drawn(Terrain(rough=1.0, relief_m=0.02, wave_m=(2.0, 2.0)))
    d_m = 0.01
    here, *around = heights(
        ground, (3, 1), (3 + d_m, 1), (3 - d_m, 1), (3, 1 + d_m), (3, 1 - d_m)
    ).T
    laplacian = (sum(around) - 4 * here) / d_m**2
    np.testing.assert_allclose(laplacian, -(np.pi**2) * here, atol=1e-4)


@pytest.mark.parametrize("rise", [0.0, 0.1])
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_a_plane_goes_through_the_ground_along_the_foot(rise, yaw):
    robot = model.build_model()
    planes = Planes([robot], tuple(robot.geom(plane).id for plane in model.PLANES))
    forward = np.array([np.cos(yaw), np.sin(yaw), rise]) / np.hypot(1, rise)
    place = np.array([1.0, 2.0, 0.3])
    planes.lay(np.array([[True, False]]), np.tile(place, (1, 2, 1)), np.tile(forward, (1, 2, 1)))
    data = mujoco.MjData(robot)
    mujoco.mj_forward(robot, data)
    plane = data.geom("left_ground")
    across, up = plane.xmat.reshape(3, 3)[:, 1], plane.xmat.reshape(3, 3)[:, 2]
    np.testing.assert_allclose(plane.xpos, place)
    assert up @ forward == pytest.approx(0, abs=1e-12)
    assert across[2] == pytest.approx(0, abs=1e-12)
    assert up[2] > 0
    assert not data.geom("right_ground").xpos.any()
