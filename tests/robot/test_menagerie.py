import re
import struct
import sys

import mujoco
import numpy as np
import pytest

from spikeport.errors import MissingExtraError, SpikeportError, UsageError
from spikeport.robot.description import JOINTS, load
from spikeport.robot.menagerie import APPEARANCE, model_file
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant

STAND_IN = """
<mujoco>
  <compiler meshdir="assets"/>
  <asset>
    <material name="red" rgba="1 0 0 1"/>
    <mesh file="brick.stl" scale="2 2 2"/>
  </asset>
  <worldbody>
    <body name="pelvis">
      <geom type="mesh" mesh="brick" pos="0 0 0.5" material="red"/>
      <geom type="sphere" size="1"/>
      <body name="tail"><geom type="mesh" mesh="brick"/></body>
    </body>
  </worldbody>
</mujoco>
"""


def tetrahedron():
    """Return a binary STL file of four triangles."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4") * 0.05
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    rows = (struct.pack("<3f", 0, 0, 0) + corners[list(f)].tobytes() + b"\0\0" for f in faces)
    return b"\0" * 80 + struct.pack("<I", 4) + b"".join(rows)


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Return a checkout of Menagerie whose H1 is one mesh on the pelvis."""
    assets = tmp_path / "unitree_h1" / "assets"
    assets.mkdir(parents=True)
    (assets / "brick.stl").write_bytes(tetrahedron())
    (assets.parent / "h1.xml").write_text(STAND_IN)
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))


@pytest.fixture(scope="module")
def theirs():
    try:
        return mujoco.MjModel.from_xml_path(str(model_file(APPEARANCE)))
    except SpikeportError as error:
        pytest.skip(str(error))


@pytest.mark.usefixtures("stand_in")
def test_meshes_replace_our_visual_shapes_on_bodies_of_the_same_name():
    model = load("menagerie")
    visual = np.flatnonzero(model.geom_group == 2)
    assert len(visual) == 1
    assert model.geom_type[visual[0]] == mujoco.mjtGeom.mjGEOM_MESH
    assert model.body(model.geom_bodyid[visual[0]]).name == "pelvis"
    assert list(model.geom_rgba[visual[0]]) == [1, 0, 0, 1]
    assert not model.geom_contype[visual].any()
    assert not model.geom_conaffinity[visual].any()
    corners = model.mesh_vert
    longest = np.linalg.norm(corners[:, None] - corners[None], axis=2).max()
    assert longest == pytest.approx(0.1 * 2**0.5)  # the file's edge, 0.05 sqrt 2, twice as large


@pytest.mark.usefixtures("stand_in")
def test_meshes_leave_the_physics_as_it_is():
    plain, dressed = load(), load("menagerie")
    for field in ("body_mass", "body_inertia", "body_ipos", "jnt_range", "dof_armature"):
        np.testing.assert_array_equal(getattr(plain, field), getattr(dressed, field))
    assert (plain.geom_conaffinity == 1).sum() == (dressed.geom_conaffinity == 1).sum()


def test_nothing_is_downloaded_for_an_empty_root(tmp_path, monkeypatch):
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))
    with pytest.raises(UsageError) as error:
        load("menagerie")
    assert str(error.value) == (
        f"Menagerie's unitree_h1 is not in {tmp_path}/unitree_h1, and spikeport downloads nothing; "
        "set MENAGERIE_ROOT to a checkout of github.com/google-deepmind/mujoco_menagerie"
    )


def test_nothing_is_downloaded_into_an_empty_cache(tmp_path, monkeypatch):
    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    monkeypatch.setenv("MENAGERIE_CACHE_DIR", str(tmp_path))
    with pytest.raises(UsageError, match=f"is not in {tmp_path}/models/unitree_h1-"):
        load("menagerie")
    assert list(tmp_path.iterdir()) == []


def dressed():
    load("menagerie")


def with_its_feet():
    PerturbedPlant(Perturbation(robot_model="menagerie"))


@pytest.mark.parametrize(
    ("use", "setting"), [(dressed, "appearance"), (with_its_feet, "robot_model")]
)
def test_absent_package_names_the_setting_and_the_extra(monkeypatch, use, setting):
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", None)
    with pytest.raises(MissingExtraError) as error:
        use()
    assert str(error.value) == (
        f"{setting} 'menagerie' needs the package mujoco-menagerie, which is absent; "
        "install it with: pip install 'spikeport[menagerie]'"
    )


FOOTLESS = '<mujoco><worldbody><body name="left_ankle_link"/></worldbody></mujoco>'
JUNK = r"MuJoCo cannot read it \(XML parse error .+\)"


@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize(
    ("use", "model", "fault"),
    [
        (with_its_feet, "junk", JUNK),
        (with_its_feet, "<mujoco/>", "it has no body 'left_ankle_link'"),
        (
            with_its_feet,
            FOOTLESS,
            "its body 'left_ankle_link' lacks a capsule of class 'foot1' with a radius and two "
            "ends",
        ),
        (dressed, "junk", JUNK),
        (dressed, "<mujoco/>", "it has no mesh on a body of the H1"),
        (
            dressed,
            STAND_IN.replace("brick", "none"),
            r"MuJoCo cannot compile it \(.*none\.stl.*\)",
        ),
    ],
)
def test_a_broken_model_is_refused_with_its_file_and_its_fault(tmp_path, use, model, fault):
    file = tmp_path / "unitree_h1" / "h1.xml"
    file.write_text(model)
    with pytest.raises(UsageError) as error:
        use()
    start, cure = (
        f"Menagerie's unitree_h1 '{file}': ",
        ("; cure: set MENAGERIE_ROOT to a checkout of github.com/google-deepmind/mujoco_menagerie"),
    )
    assert re.fullmatch(f"{re.escape(start)}{fault}{re.escape(cure)}", str(error.value))


def tensors(model, body):
    """Return inertia of a body about its centre of mass, in the body's frame."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body(body).iquat)
    axes = rotation.reshape(3, 3)
    return axes @ np.diag(model.body(body).inertia) @ axes.T


def test_masses_and_inertias_equal_menageries(theirs):
    ours = load()
    for i in range(1, theirs.nbody):
        name = theirs.body(i).name
        assert ours.body(name).mass == theirs.body(name).mass
        np.testing.assert_allclose(ours.body(name).ipos, theirs.body(name).ipos, atol=1e-9)
        np.testing.assert_allclose(tensors(ours, name), tensors(theirs, name), atol=1e-6)


def test_joints_equal_menageries(theirs):
    ours = load()
    for joint in JOINTS:
        for field in ("range", "axis", "pos", "damping", "armature"):
            expected = getattr(theirs.joint(joint), field)
            np.testing.assert_allclose(getattr(ours.joint(joint), field), expected, atol=1e-9)


def test_kinematics_equal_menageries(theirs):
    ours = load()
    data, other = mujoco.MjData(ours), mujoco.MjData(theirs)
    rng = np.random.RandomState(0)
    for _ in range(20):
        for joint in JOINTS:
            data.joint(joint).qpos = other.joint(joint).qpos = rng.uniform(-1, 1)
        mujoco.mj_kinematics(ours, data)
        mujoco.mj_kinematics(theirs, other)
        for i in range(1, theirs.nbody):
            name = theirs.body(i).name
            np.testing.assert_allclose(data.body(name).xpos, other.body(name).xpos, atol=1e-5)
