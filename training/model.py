"""The robot model for training: no visual shapes, position actuators, foot sensors."""

import numpy as np

from spikeport.robot import actuators
from spikeport.robot.description import JOINTS, KD, KP, MODEL_PATH
from spikeport.robot.engine import mujoco
from spikeport.robot.feet import FOOT_PARTS, SIDES
from spikeport.robot.foot_sensors import add_foot_sensors

HEEL_RADIUS_M, TOE_RADIUS_M = 0.02, 0.015
"""Radii of the contact shapes of a foot in ``h1.xml``."""

PLANES = ("left_ground", "right_ground")
"""Floor geoms, one for each foot alone, left first; see `spikeport.training.terrain`."""


def build_model() -> mujoco.MjModel:
    """Return the compiled model.

    Visual shapes, equality constraints and the sensors of ``h1.xml`` are left out, and the sensors
    of `spikeport.robot.foot_sensors` are added. Each foot has its own floor; there is no other.
    """
    spec = mujoco.MjSpec.from_file(str(MODEL_PATH))
    skin = [geom for geom in spec.geoms if geom.classname.name == "skin"]
    looks = (*skin, *spec.lights, *spec.cameras, *spec.materials, *spec.textures)
    for element in (*looks, *spec.sensors, *spec.equalities):
        spec.delete(element)
    spec.delete(spec.geom("floor"))
    add_foot_sensors(spec)
    for geom in spec.geoms:
        # Named pairs alone touch. MuJoCo's search for others takes a fifteenth of each step, and
        # searches around the places that floors had when the model was compiled.
        geom.contype = geom.conaffinity = 0
    for foot, plane in zip(SIDES, PLANES, strict=True):
        _add_ground(spec, foot, plane)
    model = spec.compile()
    for plane in PLANES:
        model.geom(plane).sameframe[0] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # it will be moved
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND  # one robot is one island: faster
    actuators.set_position_mode(model, np.arange(len(JOINTS)), KP, KD)
    return model


def floor_pairs(model: mujoco.MjModel) -> list[int]:
    """Return the numbers of the pairs of a floor and a part of its foot; they have the friction."""
    planes = [model.geom(plane).id for plane in PLANES]
    return np.flatnonzero(np.isin(model.pair_geom1, planes)).tolist()


def _add_ground(spec: mujoco.MjSpec, foot: str, plane: str) -> None:
    """Add the floor that only one foot touches; contacts have the floor's properties."""
    spec.worldbody.add_geom(
        name=plane,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.05],
        contype=0,
        conaffinity=0,
        priority=1,
    )
    for part in FOOT_PARTS:
        spec.add_pair(geomname1=plane, geomname2=f"{foot}_{part}")
