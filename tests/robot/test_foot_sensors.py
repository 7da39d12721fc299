"""Sensors at the feet of a simulated robot."""

import numpy as np

from spikeport.robot.description import MODEL_PATH
from spikeport.robot.engine import mujoco
from spikeport.robot.foot_sensors import SENSORS, add_foot_sensors


def test_the_left_foot_comes_first_behind_the_robots_own_sensors():
    spec = mujoco.MjSpec.from_file(str(MODEL_PATH))
    before = spec.compile().nsensordata
    add_foot_sensors(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    size = sum(SENSORS.values())
    assert model.nsensordata == before + 2 * size
    left, right = data.sensordata[-2 * size :].reshape(2, size)
    np.testing.assert_allclose(left[:3], data.geom("left_heel").xpos)
    np.testing.assert_allclose(right[3:6], data.geom("right_toe").xpos)
    assert not left[6:12].any()
