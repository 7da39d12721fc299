"""The robot with a perturbation, compared with the plain robot."""

import itertools

import numpy as np
import pytest

from spikeport.errors import DivergedError, UsageError
from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco
from spikeport.robot.feet import Feet
from spikeport.robot.perturbation import NONE, Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.plant import Plant
from spikeport.robot.pushes import Pushes
from spikeport.robot.state import in_plane


def moved(plant, seed=3, steps=40):
    """Lift the arms of a standing robot, and return it."""
    plant.reset(seed)
    for step in range(steps):
        plant.hold(JOINTS[11:], 0.01 * step)
        plant.step()
    return plant


@pytest.fixture(scope="module")
def plain():
    return moved(Plant())


def test_without_a_perturbation_the_motion_is_the_plain_plants_bit_for_bit(plain):
    unperturbed = moved(PerturbedPlant(NONE))
    np.testing.assert_array_equal(unperturbed.data.qpos, plain.data.qpos)
    np.testing.assert_array_equal(unperturbed.data.qvel, plain.data.qvel)
    for found, true in zip(unperturbed.state, plain.state, strict=True):
        np.testing.assert_array_equal(found, true)
    np.testing.assert_array_equal(unperturbed.in_plane, plain.in_plane)
    assert unperturbed.height_m == plain.height_m


def test_a_run_depends_on_its_seed_alone():
    asked = Perturbation(push=1.0, push_every=0.1, sensor_noise=1.0, terrain="relief:0.02")
    plant = moved(PerturbedPlant(asked))
    first = plant.data.qpos.copy(), plant.state
    moved(plant, seed=4)
    assert not np.array_equal(plant.data.qpos, first[0])
    again = moved(plant)
    np.testing.assert_array_equal(again.data.qpos, first[0])
    np.testing.assert_array_equal(again.state.dq, first[1].dq)


def test_observations_are_late_by_the_observation_delay():
    late, now = moved(PerturbedPlant(Perturbation(observation_delay=0.02))), PerturbedPlant(NONE)
    np.testing.assert_array_equal(late.state.q, moved(now, steps=36).state.q)
    np.testing.assert_allclose(late.in_plane, in_plane(late.state))


def test_commands_are_late_by_the_action_delay():
    plant, now = PerturbedPlant(Perturbation(action_delay=0.015)), PerturbedPlant(NONE)
    for each in (plant, now):
        each.reset(3)
    plant.hold(["left_elbow"], 1.5)
    for _ in range(3):
        plant.step()
        now.step()
    np.testing.assert_array_equal(plant.data.qpos, now.data.qpos)
    plant.step()
    now.step()
    assert plant.data.qpos[-5] != now.data.qpos[-5]


def test_a_step_that_diverges_leaves_the_command_that_was_set(monkeypatch):
    plant = PerturbedPlant(Perturbation(action_delay=0.02), anchored=True)
    plant.reset(3)
    plant.torque(["right_elbow"], [3.0])
    wanted = plant.data.ctrl.copy(), plant.model.actuator_gainprm.copy()

    def diverge(_plant):
        raise DivergedError("")

    monkeypatch.setattr(Plant, "step", diverge)
    with pytest.raises(DivergedError):
        plant.step()
    np.testing.assert_array_equal(plant.data.ctrl, wanted[0])
    np.testing.assert_array_equal(plant.model.actuator_gainprm, wanted[1])


def test_delayed_torques_stay_torques_and_delayed_angles_stay_angles():
    plant = PerturbedPlant(Perturbation(action_delay=0.02), anchored=True)
    joints, torques_nm = ["right_shoulder_pitch", "right_elbow"], [8.0, 3.0]
    places = [JOINTS.index(joint) for joint in joints]

    def forces(steps):
        found = []
        for _ in range(steps):
            plant.step()
            found.append(plant.data.actuator_force[places].copy())
        return found

    plant.reset(3)
    plant.torque(joints, torques_nm)
    forces(4)  # 20 ms
    np.testing.assert_allclose(forces(1), [torques_nm])
    plant.hold(joints, plant.state.q[places])
    np.testing.assert_allclose(forces(4), [torques_nm] * 4)
    q, dq = plant.data.qpos[7:][places].copy(), plant.data.qvel[6:][places].copy()
    gain, bias = plant.model.actuator_gainprm[places, 0], plant.model.actuator_biasprm[places]
    (held,) = forces(1)
    springs = gain * plant.data.ctrl[places] + bias[:, 1] * q + bias[:, 2] * dq
    np.testing.assert_allclose(held, springs, rtol=1e-6)


def test_a_push_changes_the_horizontal_velocity():
    plant = PerturbedPlant(Perturbation(push=0.5, push_every=0.1))
    plant.reset(0)
    speeds = []
    for _ in range(40):
        plant.step()
        speeds.append(np.linalg.norm(plant.data.qvel[:2]))
    assert max(np.diff(speeds)) > 0.2


def test_the_floor_brakes_a_pushed_robot_by_its_velocity_after_the_push(monkeypatch):
    pushed, moving = moved(PerturbedPlant(NONE)), moved(Plant())
    push_m_s = np.array([0.5, 0.2])
    monkeypatch.setattr(Pushes, "due", lambda *_: push_m_s)
    moving.data.qvel[:2] += push_m_s
    mujoco.mj_forward(moving.model, moving.data)
    for each in (pushed, moving):
        each.step()
    np.testing.assert_allclose(pushed.data.qvel, moving.data.qvel, atol=1e-6)


def test_bodies_and_motors_are_altered(plain):
    heavy = PerturbedPlant(Perturbation(mass=1.1, payload=5.0, com_x=0.04, strength=0.5)).model
    own = plain.model
    torso = own.body("torso_link").id
    assert heavy.body_mass.sum() == pytest.approx(1.1 * own.body_mass.sum() + 5)
    assert heavy.body_ipos[torso] == pytest.approx(own.body_ipos[torso] + [0.04, 0, 0])
    np.testing.assert_allclose(heavy.body_inertia, 1.1 * own.body_inertia, rtol=1e-6)
    np.testing.assert_allclose(heavy.actuator_forcerange, 0.5 * own.actuator_forcerange)


def test_gains_and_friction_are_altered():
    plant = PerturbedPlant(Perturbation(gains=0.8, friction=0.3))
    assert plant.model.actuator_gainprm[JOINTS.index("left_knee"), 0] == pytest.approx(160)
    plant.step()
    assert plant.data.ncon
    assert plant.data.contact.friction[0, 0] == pytest.approx(0.3)


def test_unitrees_urdf_has_other_masses_and_ranges(plain):
    model = PerturbedPlant(Perturbation(robot_model="urdf")).model
    assert model.body_mass.sum() == pytest.approx(59.338)
    right, left = model.body("right_knee_link"), model.body("left_knee_link")
    assert right.mass[0] == left.mass[0] == pytest.approx(2.824)
    assert right.ipos == pytest.approx(left.ipos * [1, -1, 1])
    np.testing.assert_allclose(right.inertia, left.inertia)
    assert model.joint("left_hip_pitch").range == pytest.approx([-3.14, 2.53])
    assert model.joint("left_knee").range == pytest.approx(plain.model.joint("left_knee").range)


@pytest.mark.parametrize("terrain", ["slope:6", "slope:6:90", "boxes:0.02", "relief:0.02"])
def test_a_robot_stands_on_its_terrain(terrain):
    plant = PerturbedPlant(Perturbation(terrain=terrain))
    plant.reset(1)
    assert plant.lowest_sole_m() == pytest.approx(0, abs=1e-9)
    for _ in range(60):
        plant.step()
    assert 0.86 < plant.height_m < 1.0


@pytest.mark.parametrize("seed", [83, 145, 371])
def test_no_toe_begins_inside_a_box_beneath_one_of_its_ends(seed):
    plant = PerturbedPlant(Perturbation(terrain="boxes:0.1"))
    plant.reset(seed)
    floors = plant.model.geom_contype > 0
    deepest_m = [c.dist for c in plant.data.contact if floors[c.geom].any()]
    assert plant.lowest_sole_m() == pytest.approx(0, abs=1e-9)
    # A rounded rim of a sole may reach over the edge of a box.
    assert min(deepest_m, default=0.0) > -0.005


def test_a_refused_posture_leaves_the_robot_and_its_floor(plain):
    plant = moved(PerturbedPlant(Perturbation(terrain="relief:0.02")))
    for robot in (plain, plant):
        before = robot.data.qpos.copy(), robot.time_s, robot.model.body_pos.copy()
        for posture_rad in ({"left_wing": 1.0}, {"left_knee": np.nan}):
            with pytest.raises(UsageError):
                robot.reset(9, posture_rad=posture_rad)
        np.testing.assert_array_equal(robot.data.qpos, before[0])
        assert robot.time_s == before[1]
        np.testing.assert_array_equal(robot.model.body_pos, before[2])


@pytest.mark.parametrize("estimator", ["leg-odometry", "ekf"])
def test_an_estimator_takes_the_place_of_the_truth(estimator):
    plant = moved(PerturbedPlant(Perturbation(estimator=estimator)))
    true = plant.true_in_plane
    assert not np.array_equal(plant.in_plane, true)
    np.testing.assert_allclose(plant.in_plane, true, atol=0.1)
    np.testing.assert_allclose(plant.state.q, plant.data.qpos[7:])  # arms that have moved
    np.testing.assert_array_equal(plant.in_plane[1:3], plant.state.base_position[:2])
    assert plant.in_plane[1:3].all()


FEET = """
<mujoco>
  <default>
    <default class="foot1"><geom type="capsule" size=".014" fromto="-.035 0 -.056 .02 0 -.045"/>
    </default>
    <default class="foot2"><geom type="capsule" size=".014" fromto=".02 0 -.045 .115 0 -.056"/>
    </default>
    <default class="foot3"><geom type="capsule" size=".014" fromto=".14 -.03 -.056 .14 .03 -.056"/>
    </default>
  </default>
  <worldbody>
    <body name="left_ankle_link">
      <geom class="foot1"/><geom class="foot2"/><geom class="foot3"/>
    </body>
    <body name="right_ankle_link">
      <geom class="foot1"/><geom class="foot2"/><geom class="foot3"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def on_menageries_feet(tmp_path, monkeypatch):
    (tmp_path / "unitree_h1").mkdir()
    (tmp_path / "unitree_h1" / "h1.xml").write_text(FEET)
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))
    return PerturbedPlant(Perturbation(robot_model="menagerie"))


def test_a_foot_stands_on_the_middle_of_menageries_three_shapes_alone(on_menageries_feet):
    plant = on_menageries_feet
    for side, part in itertools.product(("left", "right"), ("heel", "toe")):
        plant.model.geom(f"{side}_{part}").pos[2] += 0.03
    plant.reset(0, perturbation_rad=0.0)
    plant.data.qpos[2] -= 0.001
    mujoco.mj_forward(plant.model, plant.data)
    assert plant.lowest_sole_m() == pytest.approx(-0.001)
    assert Feet(plant.model).on_floor(plant.data).all()


def test_menageries_feet_are_three_capsules(on_menageries_feet):
    plant = on_menageries_feet
    shapes = [plant.model.geom(f"left_{part}") for part in ("heel", "sole", "toe")]
    assert [shape.size[0] for shape in shapes] == pytest.approx([0.014] * 3)
    assert shapes[2].pos == pytest.approx([0.14, 0, -0.056])
    for _ in range(60):
        plant.step()
    assert 0.86 < plant.height_m < 1.0
