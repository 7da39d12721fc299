"""MuJoCo Menagerie's H1: its visual meshes and its feet, for our model; nothing is downloaded."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport.errors import UsageError
from spikeport.extras import missing
from spikeport.reading.mismatch import shown
from spikeport.robot.engine import mujoco
from spikeport.robot.feet import SIDES

NAME = "unitree_h1"
CHECKOUT = "set MENAGERIE_ROOT to a checkout of github.com/google-deepmind/mujoco_menagerie"
APPEARANCE, ROBOT_MODEL = "appearance 'menagerie'", "robot_model 'menagerie'"
"""The settings that ask for the model, for messages."""
_FOOT = {"foot1": "heel", "foot2": "sole", "foot3": "toe"}
"""Menagerie's classes of contact shapes, and their names here."""


class Capsule(NamedTuple):
    """A capsule of a foot: the sizes of its shape, and its two ends (6,), in m."""

    size: np.ndarray
    fromto: np.ndarray


def model_file(user: str) -> Path:
    """Return the XML file of Menagerie's H1 on this machine.

    The file is looked for in the folder of the environment variable MENAGERIE_ROOT (a checkout of
    Menagerie), or, without one, in the cache of the package ``mujoco-menagerie``. ``user`` is the
    setting that asks for it.

    Raises
    ------
    MissingExtraError
        The package ``mujoco-menagerie`` is absent.
    UsageError
        The model is not there.
    """
    try:
        import mujoco_menagerie
    except ImportError as error:
        raise missing(user, "mujoco-menagerie", "menagerie") from error
    robot, cache = mujoco_menagerie.get(NAME), mujoco_menagerie.Cache()
    folder: Path = cache.root / NAME if cache.root else cache.model_path(robot)
    if not (folder.is_dir() if cache.root else cache.is_cached(robot)):
        raise UsageError(
            f"Menagerie's {NAME} is not in {folder}, and spikeport downloads nothing; {CHECKOUT}"
        )
    return folder.joinpath(robot.entry(robot.default_model).file)


def feet() -> dict[tuple[str, str], Capsule]:
    """Return the capsules of Menagerie's feet, by side and by part of the foot.

    Raises
    ------
    MissingExtraError, UsageError
        As `model_file`; UsageError also for a model without such feet.
    """
    path = model_file(ROBOT_MODEL)
    theirs = _read(path)
    return {
        (side, part): _capsule(path, theirs, f"{side}_ankle_link", kind)
        for side in SIDES
        for kind, part in _FOOT.items()
    }


def _capsule(path: Path, theirs: mujoco.MjSpec, name: str, kind: str) -> Capsule:
    """Return the capsule of a class on a body."""
    body = theirs.body(name)
    if body is None:
        raise _refused(path, f"it has no body '{name}'")
    shape = {geom.classname.name: geom for geom in body.geoms}.get(kind)
    if (
        shape is None
        or shape.type != mujoco.mjtGeom.mjGEOM_CAPSULE
        or not (shape.size[0] > 0 and np.isfinite(shape.fromto).all())
    ):
        rule = f"a capsule of class '{kind}' with a radius and two ends"
        raise _refused(path, f"its body '{name}' lacks {rule}")
    return Capsule(shape.size.copy(), shape.fromto.copy())


def _read(path: Path) -> mujoco.MjSpec:
    with _refusing(path, "read"):
        return mujoco.MjSpec.from_file(str(path))


@contextmanager
def _refusing(path: Path, does: str) -> Iterator[None]:
    """Refuse a model with which MuJoCo cannot do what it is asked for."""
    try:
        yield
    except ValueError as error:
        reason = " ".join(str(error).split())  # it has several lines
        raise _refused(path, f"MuJoCo cannot {does} it ({reason})") from error


def _refused(path: Path, fault: str) -> UsageError:
    return UsageError(f"Menagerie's {NAME} '{path}': {shown(fault)}; cure: {CHECKOUT}")


def dress(spec: mujoco.MjSpec) -> None:
    """Replace our visual geoms by the meshes of Menagerie's bodies of the same name.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Our robot, changed in place; contacts, masses and joints stay as they are.

    Raises
    ------
    MissingExtraError, UsageError
        As `model_file`; UsageError also for a model without such meshes, or a broken one.
    """
    path = model_file(APPEARANCE)
    theirs = _read(path)
    for geom in [g for g in spec.geoms if g.classname.name == "skin"]:
        spec.delete(geom)
    for mesh in theirs.meshes:
        file = (path.parent / theirs.meshdir / mesh.file).resolve()
        spec.add_mesh(name=_mesh_name(mesh), file=str(file), scale=mesh.scale)
    skin = spec.find_default("skin")
    meshes = list(_meshes(spec, theirs))
    if not meshes:
        raise _refused(path, "it has no mesh on a body of the H1")
    for body, geom in meshes:
        _hang(body, geom, _colour(theirs, geom), skin)
    with _refusing(path, "compile"):  # which opens the files of its meshes
        theirs.compile()


def _meshes(
    spec: mujoco.MjSpec, theirs: mujoco.MjSpec
) -> Iterator[tuple[mujoco.MjsBody, mujoco.MjsGeom]]:
    """Yield our bodies, and the meshes on their bodies of the same name."""
    for theirs_body in theirs.bodies:
        body = spec.body(theirs_body.name)
        for geom in theirs_body.geoms:
            if geom.type == mujoco.mjtGeom.mjGEOM_MESH and body is not None:
                yield body, geom


def _mesh_name(mesh: mujoco.MjsMesh) -> str:
    return mesh.name or Path(mesh.file).stem


def _colour(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> np.ndarray:
    material = spec.material(geom.material) if geom.material else None
    rgba: np.ndarray = geom.rgba if material is None else material.rgba
    return rgba


def _hang(
    body: mujoco.MjsBody, geom: mujoco.MjsGeom, rgba: np.ndarray, skin: mujoco.MjsDefault
) -> None:
    body.add_geom(
        skin,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=geom.meshname,
        pos=geom.pos,
        quat=geom.quat,
        rgba=rgba,
    )
