"""The model of the robot in training."""

import numpy as np
import pytest

from spikeport.robot.description import JOINTS, KD, KP, load
from spikeport.robot.engine import mujoco
from spikeport.robot.foot_sensors import SENSORS
from spikeport.training import model


@pytest.fixture(scope="module")
def built():
    return model.build_model()


def test_the_model_has_joints_and_masses_of_the_deployed_robot(built):
    whole = load()
    assert [built.joint(i).name for i in range(1, built.njnt)] == list(JOINTS)
    np.testing.assert_allclose(built.body_mass, whole.body_mass)
    np.testing.assert_allclose(built.dof_armature, whole.dof_armature)
    assert built.neq == 0
    assert built.opt.timestep == whole.opt.timestep


def test_actuators_hold_positions_with_the_robots_gains(built):
    np.testing.assert_array_equal(built.actuator_gainprm[:, 0], KP)
    np.testing.assert_array_equal(built.actuator_biasprm[:, 1], -KP)
    np.testing.assert_array_equal(built.actuator_biasprm[:, 2], -KD)


def test_sensors_of_the_left_foot_come_first(built):
    assert built.nsensordata == 2 * sum(SENSORS.values())
    assert built.sensor_dim.tolist() == list(SENSORS.values()) * 2
    data = mujoco.MjData(built)
    mujoco.mj_forward(built, data)
    left, right = np.split(data.sensordata, 2)
    assert left[1] > 0 > right[1]  # y of the heels: left is positive
    np.testing.assert_allclose(left[[0, 2]], right[[0, 2]], atol=1e-9)


def test_each_foot_stands_on_a_floor_of_its_own(built):
    data = mujoco.MjData(built)
    data.qpos[2] = 1.0
    mujoco.mj_forward(built, data)
    pairs = {tuple(sorted(built.geom(g).name for g in contact.geom)) for contact in data.contact}
    assert pairs
    assert {pair[0].split("_")[0] == pair[1].split("_")[0] for pair in pairs} == {True}
    assert {name for pair in pairs for name in pair} & set(model.PLANES) == set(model.PLANES)


def test_only_feet_can_meet_a_floor(built):
    assert not built.geom_contype.any()
    meet = built.pair_geom2[model.floor_pairs(built)]
    assert [built.geom(geom).name for geom in meet] == [
        "left_heel",
        "left_toe",
        "right_heel",
        "right_toe",
    ]


@pytest.mark.parametrize("height_m", [-0.3, 0.3])
def test_a_foot_meets_its_floor_wherever_that_is(height_m):
    # By a search, MuJoCo would only find floors near the places that they had when compiled.
    built = model.build_model()
    for plane in model.PLANES:
        built.geom(plane).pos[2] = height_m
    data = mujoco.MjData(built)
    data.qpos[2] = 1.0 + height_m
    mujoco.mj_forward(built, data)
    assert {built.geom(contact.geom[0]).name for contact in data.contact} == set(model.PLANES)
    assert [data.geom(plane).xpos[2] for plane in model.PLANES] == [height_m] * 2
