"""The weld that holds a robot while its arm works."""

import numpy as np
import pytest

from spikeport.experiments.switch.anchor import RAISING_S, Anchor
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.plant import Plant
from spikeport.robot.terrain import find_terrain


def turned(yaw_rad, tilt_rad):
    """Return the quaternion of a turn about the vertical, after a tilt about the robot's side."""
    w, z = np.cos(yaw_rad / 2), np.sin(yaw_rad / 2)
    c, s = np.cos(tilt_rad / 2), np.sin(tilt_rad / 2)
    return w * c, -z * s, w * s, z * c


@pytest.fixture
def plant():
    return Plant()


def test_an_anchored_robot_is_brought_upright_at_its_present_place_and_heading(plant):
    anchor = Anchor(plant)
    height_m = plant.data.qpos[2]
    plant.data.qpos[:7] = 3, 2, 0.8, *turned(1.0, 0.3)
    for _ in range(round(RAISING_S / plant.dt_s) + 1):
        anchor.update(True)
        plant.step()
    assert plant.anchored
    pose = plant.data.qpos[:7]
    assert pose[:3] == pytest.approx([3, 2, height_m], abs=0.02)
    assert pose[3:] == pytest.approx(turned(1.0, 0.0), abs=0.02)


def test_the_anchor_holds_and_releases_the_robot(plant):
    anchor = Anchor(plant)
    anchor.update(False)
    assert not plant.anchored
    anchor.update(True)
    assert plant.anchored
    anchor.update(False)
    assert not plant.anchored


@pytest.mark.parametrize("degrees", [6.0, -6.0])
def test_a_robot_on_a_slope_is_held_at_its_starting_height_above_it(degrees):
    plant = PerturbedPlant(Perturbation(terrain=f"slope:{degrees:g}"))
    anchor = Anchor(plant)
    plant.data.qpos[0] = 2.0
    begun_m = anchor._height_m
    plant.data.qpos[2] += begun_m - 0.05 - plant.height_m
    for _ in range(round(RAISING_S / plant.dt_s) + 1):
        anchor.update(True)
        plant.step()
    assert plant.height_m == pytest.approx(begun_m, abs=0.02)


@pytest.mark.parametrize("stride_rad", [-0.5, 0.5])
def test_on_a_slope_the_stride_does_not_change_the_height(stride_rad):
    plant = PerturbedPlant(Perturbation(terrain="slope:6"))
    anchor = Anchor(plant)
    plant.data.joint("left_hip_pitch").qpos += stride_rad
    assert anchor._way()[-1][2] == pytest.approx(plant.data.qpos[2])


@pytest.mark.parametrize(("beneath_m", "around_m"), [(0.1, 0.0), (0.0, 0.1)])
def test_a_robot_is_held_by_the_floor_beneath_its_soles(beneath_m, around_m, plant, monkeypatch):
    def floor_m(place):
        """Return the height of the floor beneath the pelvis, or around it."""
        off_m = np.hypot(*(place[:2] - plant.data.qpos[:2]))
        return beneath_m if off_m < 0.01 else around_m

    anchor, begun_m = Anchor(plant), plant.height_m
    monkeypatch.setattr(plant, "floor", find_terrain("boxes:0.01"))
    monkeypatch.setattr(plant, "_floor_m", floor_m)
    plant.data.qpos[2] += around_m
    assert anchor._way()[-1][2] == pytest.approx(begun_m + around_m)


def test_a_robot_that_starts_on_boxes_is_held_as_high_as_on_a_level_floor():
    for seed in range(3):
        plant, level = PerturbedPlant(Perturbation(terrain="boxes:0.1")), Plant()
        anchor = Anchor(plant)
        for robot in (plant, level):
            robot.reset(seed)
        anchor.reset()
        assert anchor._height_m == pytest.approx(level.height_m, abs=0.01)
