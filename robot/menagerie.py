"""The visual meshes of MuJoCo Menagerie's H1 on our model's bodies; nothing is downloaded."""

from pathlib import Path

import numpy as np

from spikeport.errors import UsageError
from spikeport.extras import missing
from spikeport.robot.engine import mujoco

NAME = "unitree_h1"


def model_file() -> Path:
    """Return the XML file of Menagerie's H1 on this machine.

    The file is looked for in the folder of the environment variable MENAGERIE_ROOT (a checkout of
    Menagerie), or, without one, in the cache of the package ``mujoco-menagerie``.

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
        raise missing("appearance 'menagerie'", "mujoco-menagerie", "menagerie") from error
    robot, cache = mujoco_menagerie.get(NAME), mujoco_menagerie.Cache()
    folder: Path = cache.root / NAME if cache.root else cache.model_path(robot)
    if not (folder.is_dir() if cache.root else cache.is_cached(robot)):
        raise UsageError(
            f"Menagerie's {NAME} is not in {folder}, and spikeport downloads nothing; set "
            "MENAGERIE_ROOT to a checkout of github.com/google-deepmind/mujoco_menagerie"
        )
    return folder.joinpath(robot.entry(robot.default_model).file)


def dress(spec: mujoco.MjSpec) -> None:
    """Replace our visual geoms by the meshes of Menagerie's bodies of the same name.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Our robot, changed in place; contacts, masses and joints stay as they are.

    Raises
    ------
    MissingExtraError, UsageError
        As `model_file`.
    """
    path = model_file()
    theirs = mujoco.MjSpec.from_file(str(path))
    for geom in [g for g in spec.geoms if g.classname.name == "skin"]:
        spec.delete(geom)
    for mesh in theirs.meshes:
        file = (path.parent / theirs.meshdir / mesh.file).resolve()
        spec.add_mesh(name=_mesh_name(mesh), file=str(file), scale=mesh.scale)
    skin = spec.find_default("skin")
    for theirs_body in theirs.bodies:
        body = spec.body(theirs_body.name)
        for geom in theirs_body.geoms:
            if geom.type == mujoco.mjtGeom.mjGEOM_MESH and body is not None:
                _hang(body, geom, _colour(theirs, geom), skin)


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
