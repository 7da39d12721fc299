"""Alterations of the robot's body and floor, made in the model before it is compiled."""

import numpy as np

from spikeport.errors import UsageError
from spikeport.robot import menagerie, urdf
from spikeport.robot.engine import mujoco
from spikeport.robot.feet import SIDES
from spikeport.robot.perturbation import MENAGERIE, URDF, Perturbation

TORSO = "torso_link"
WEAKEST = 1e-9
"""The smallest scale of torque limits: MuJoCo takes 0 as no limit, and 1e-9 moves nothing."""
_MIRRORED_COM = np.array([1, -1, 1])
_MIRRORED_INERTIA = np.array([1, 1, 1, -1, 1, -1])


def alter(spec: mujoco.MjSpec, perturbation: Perturbation) -> None:
    """Change a model's body, torque limits and friction as a perturbation asks for.

    Raises
    ------
    MissingExtraError, UsageError
        The perturbation asks for Menagerie's feet, which are not on this machine, or broken.
    """
    if perturbation.robot_model == URDF:
        _take_urdf(spec)
    if perturbation.robot_model == MENAGERIE:
        _take_menagerie_feet(spec)
    _weigh(spec, perturbation)
    for actuator in spec.actuators:
        actuator.forcerange *= max(perturbation.strength, WEAKEST)
    for geom in spec.geoms:
        if geom.contype:  # the floor; its higher priority makes contacts use its friction
            geom.friction[0], geom.priority = perturbation.friction, 1


def _weigh(spec: mujoco.MjSpec, perturbation: Perturbation) -> None:
    for body in spec.bodies:
        body.mass *= perturbation.mass
        # The density grows, so the inertia grows with the mass.
        body.fullinertia *= perturbation.mass
    torso = spec.body(TORSO)
    if torso.mass + perturbation.payload <= 0:
        raise UsageError(
            f"payload={perturbation.payload:g}: the torso weighs {torso.mass:.1f} kg with mass="
            f"{perturbation.mass:g}, so nothing would be left of it; cure: a larger payload"
        )
    torso.mass += perturbation.payload
    torso.ipos += np.array([perturbation.com_x, perturbation.com_y, 0.0])


def _take_urdf(spec: mujoco.MjSpec) -> None:
    """Take the masses, centres of mass, inertias and ranges of Unitree's URDF."""
    for name, link in urdf.figures()["links"].items():
        for side in SIDES if name.startswith("left_") else ("left",):
            body, right = spec.body(name.replace("left_", f"{side}_")), side == "right"
            body.mass = link["mass"]
            body.ipos = link["com"] * (_MIRRORED_COM if right else 1)
            body.fullinertia = link["inertia"] * (_MIRRORED_INERTIA if right else 1)
    for joint, span in urdf.ranges_rad().items():
        spec.joint(joint).range = span


def _take_menagerie_feet(spec: mujoco.MjSpec) -> None:
    """Take the contact shapes of Menagerie's feet: three capsules, two of which replace ours."""
    for (side, part), capsule in menagerie.feet().items():
        name = f"{side}_{part}"
        geom = spec.geom(name) or spec.body(f"{side}_ankle_link").add_geom(
            spec.find_default("solid")
        )
        geom.name, geom.type = name, mujoco.mjtGeom.mjGEOM_CAPSULE
        geom.pos = np.zeros(3)  # its end points place the capsule
        geom.size, geom.fromto = capsule.size, capsule.fromto
