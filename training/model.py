"""The robot as it is trained with: no appearance, position actuators, sensors at its feet."""

import numpy as np

from spikeport.robot import actuators
from spikeport.robot.description import GAINS, JOINTS, MODEL_PATH
from spikeport.robot.engine import mujoco
from spikeport.robot.foot_sensors import add_foot_sensors

HEEL_RADIUS_M, TOE_RADIUS_M = 0.02, 0.015
"""Of the contact shapes of a foot in ``h1.xml``."""

KP = np.array([GAINS[joint].kp for joint in JOINTS])
KD = np.array([GAINS[joint].kd for joint in JOINTS])


def build_model() -> mujoco.MjModel:
    """The compiled model.

    Shapes that only look, equality constraints and the sensors of ``h1.xml`` are left out, and
    those of `robot.foot_sensors` added.
    """
    spec = mujoco.MjSpec.from_file(str(MODEL_PATH))
    skin = [geom for geom in spec.geoms if geom.classname.name == "skin"]
    spec.geom("floor").material = ""
    looks = (*skin, *spec.lights, *spec.cameras, *spec.materials, *spec.textures)
    for element in (*looks, *spec.sensors, *spec.equalities):
        spec.delete(element)
    add_foot_sensors(spec)
    model = spec.compile()
    floor = model.geom("floor").id
    model.geom_priority[floor] = 1  # contacts take the floor's friction, which is randomised
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND  # one robot is one island: faster
    actuators.set_position_mode(model, np.arange(len(JOINTS)), KP, KD)
    return model
