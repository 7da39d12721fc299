"""The robot as it is trained with: no appearance, position actuators, sensors at its feet."""

import numpy as np

from spikeport.robot import actuators
from spikeport.robot.description import GAINS, JOINTS, MODEL_PATH
from spikeport.robot.engine import mujoco

FEET = ("left", "right")
HEEL_RADIUS_M, TOE_RADIUS_M = 0.02, 0.015
"""Of the contact shapes of a foot in ``h1.xml``."""

KP = np.array([GAINS[joint].kp for joint in JOINTS])
KD = np.array([GAINS[joint].kd for joint in JOINTS])

SENSORS = {"heel": 3, "toe": 3, "velocity": 3, "contact": 4}
"""Sensors of each foot in their order, left foot first, and their sizes."""


def build_model() -> mujoco.MjModel:
    """The compiled model.

    Shapes that only look, equality constraints and the sensors of ``h1.xml`` are left out. Each
    foot gets the positions of its heel and toe (m), the velocity of its sole (m/s), and whether
    and how it touches the floor (number of contacts, force in N), all in the world frame.
    """
    spec = mujoco.MjSpec.from_file(str(MODEL_PATH))
    skin = [geom for geom in spec.geoms if geom.classname.name == "skin"]
    spec.geom("floor").material = ""
    looks = (*skin, *spec.lights, *spec.cameras, *spec.materials, *spec.textures)
    for element in (*looks, *spec.sensors, *spec.equalities):
        spec.delete(element)
    for foot in FEET:
        _add_foot(spec, foot)
    model = spec.compile()
    floor = model.geom("floor").id
    model.geom_priority[floor] = 1  # contacts take the floor's friction, which is randomised
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND  # one robot is one island: faster
    actuators.set_position_mode(model, np.arange(len(JOINTS)), KP, KD)
    return model


def _add_foot(spec: mujoco.MjSpec, foot: str) -> None:
    kind, thing = mujoco.mjtSensor, mujoco.mjtObj
    data = mujoco.mjtConDataField
    for part in ("heel", "toe"):
        spec.add_sensor(
            type=kind.mjSENS_FRAMEPOS, objtype=thing.mjOBJ_GEOM, objname=f"{foot}_{part}"
        )
    sole = spec.body(f"{foot}_ankle_link").add_site(name=f"{foot}_sole", pos=[0.05, 0, -0.06])
    spec.add_sensor(type=kind.mjSENS_FRAMELINVEL, objtype=thing.mjOBJ_SITE, objname=sole.name)
    net_force = 3
    fields = 1 << int(data.mjCONDATA_FOUND) | 1 << int(data.mjCONDATA_FORCE)
    spec.add_sensor(
        type=kind.mjSENS_CONTACT,
        objtype=thing.mjOBJ_BODY,
        objname=f"{foot}_ankle_link",
        intprm=[fields, net_force, 1],
    )
