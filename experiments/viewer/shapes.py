"""Shapes of a robot in each pose, for a page that draws them without MuJoCo."""

from typing import NamedTuple

import numpy as np

from spikeport.robot.description import load
from spikeport.robot.engine import mujoco

# As int, since numbers in an array do not equal members of the enumeration.
SPHERE, CAPSULE, CYLINDER, ELLIPSOID, BOX = (
    int(kind)
    for kind in (
        mujoco.mjtGeom.mjGEOM_SPHERE,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        mujoco.mjtGeom.mjGEOM_BOX,
    )
)
DRAWN = (SPHERE, CAPSULE, CYLINDER, ELLIPSOID, BOX)
SOLID = 3
"""The group of geometries that collide and are not drawn."""


class Shapes(NamedTuple):
    """Rods with round ends, which a robot's geometries are drawn as.

    Attributes
    ----------
    ends_m : (n_poses, n_shapes, 2, 3) array
        Both ends of each rod, world frame, in m.
    radii_m : (n_shapes,) array
        Half of each rod's thickness, in m.
    colours : list of str
        The colour of each rod, as ``#rrggbb``.
    """

    ends_m: np.ndarray
    radii_m: np.ndarray
    colours: list[str]


def shapes(poses: np.ndarray) -> Shapes:
    """Return the H1's shapes at poses, MuJoCo's ``qpos`` (n_poses, nq)."""
    model = load()
    data = mujoco.MjData(model)
    drawn = np.flatnonzero(np.isin(model.geom_type, DRAWN) & (model.geom_group != SOLID))
    rods = np.array([_rod(model.geom_type[geom], model.geom_size[geom]) for geom in drawn])
    halves, radii_m = rods[:, :3], rods[:, 3]
    ends_m = np.empty((len(poses), len(drawn), 2, 3))
    for ends, pose in zip(ends_m, poses, strict=True):
        data.qpos[:] = pose
        # Kinematics are enough: nothing else of the physics is drawn.
        mujoco.mj_kinematics(model, data)
        turned = np.einsum("gij,gj->gi", data.geom_xmat[drawn].reshape(-1, 3, 3), halves)
        ends[:] = data.geom_xpos[drawn][:, np.newaxis] + np.stack((-turned, turned), axis=1)
    return Shapes(ends_m, radii_m, [_colour(model, int(geom)) for geom in drawn])


def _rod(kind: int, size: np.ndarray) -> np.ndarray:
    """Return half of a rod's axis (3,) and its radius, in the geometry's own frame."""
    if kind == SPHERE:
        return np.array([0, 0, 0, size[0]])
    if kind in (CAPSULE, CYLINDER):
        # Round ends stick out of a cylinder: the rod is that much shorter.
        out = size[0] * (kind == CYLINDER)
        return np.array([0, 0, max(size[1] - out, 0), size[0]])
    longest = int(np.argmax(size))
    # A round rod of about the same cross-section.
    radius = np.sqrt(np.prod(np.delete(size, longest)))
    half = np.zeros(3)
    half[longest] = max(size[longest] - radius, 0)
    return np.array([*half, radius])


def _colour(model: mujoco.MjModel, geom: int) -> str:
    material = model.geom_matid[geom]
    rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    return "#" + "".join(f"{round(255 * part):02x}" for part in rgba[:3])
