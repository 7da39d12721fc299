"""Rods that stand for the robot's geometries."""

import mujoco
import numpy as np

from spikeport.experiments.viewer.shapes import shapes
from spikeport.robot.plant import Plant


def test_rods_lie_where_the_geometries_are():
    plant = Plant()
    drawn = shapes(plant.data.qpos[np.newaxis])
    mujoco.mj_kinematics(plant.model, plant.data)
    middles = drawn.ends_m[0].mean(axis=1)
    places = plant.data.geom_xpos
    assert all(np.abs(places - middle).sum(axis=1).min() < 1e-12 for middle in middles)
    assert len(middles) == len(drawn.radii_m) == len(drawn.colours) > 50
    assert (drawn.radii_m > 0).all()
    assert drawn.ends_m[..., 2].min() > -0.05
    assert 1.2 < drawn.ends_m[..., 2].max() < 2


def test_rods_move_with_the_robot():
    pose = Plant().data.qpos
    lifted = pose.copy()
    lifted[2] += 0.5
    one, other = shapes(np.stack((pose, lifted))).ends_m
    np.testing.assert_allclose(other - one, np.broadcast_to([0, 0, 0.5], one.shape), atol=1e-12)
