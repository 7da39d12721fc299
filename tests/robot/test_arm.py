import mujoco
import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot.arm import ArmDynamics
from spikeport.robot.description import ARM_JOINTS, DEFAULT_POSE, load

POSTURES = np.random.RandomState(0).uniform([-1, -1, -1, -0.5], [0.5, 0.2, 1, 1.5], (8, 4))
LINKS = [f"{joint}_link" for joint in ARM_JOINTS]


@pytest.fixture(scope="module")
def arm():
    return ArmDynamics()


@pytest.fixture(scope="module")
def model():
    return load()


def placed(model, q):
    """Return simulation data of the whole robot with the right arm at q, everything computed."""
    data = mujoco.MjData(model)
    for joint, angle in {**DEFAULT_POSE, **dict(zip(ARM_JOINTS, q, strict=True))}.items():
        data.joint(joint).qpos = angle
    mujoco.mj_forward(model, data)
    return data


def differences(function, q, step=1e-6):
    """Return central differences, one column per joint."""
    moves = np.eye(4) * step
    return np.stack([(function(q + d) - function(q - d)) / (2 * step) for d in moves], axis=-1)


@pytest.mark.parametrize("q", POSTURES)
def test_position_is_that_of_the_hand_of_the_whole_robot(arm, model, q):
    np.testing.assert_allclose(arm.at(q).position, placed(model, q).site("right_hand").xpos)


@pytest.mark.parametrize("q", POSTURES)
def test_jacobian_is_the_derivative_of_the_position(arm, q):
    expected = differences(lambda x: arm.at(x).position, q)
    np.testing.assert_allclose(arm.at(q).jacobian, expected, atol=1e-8)


@pytest.mark.parametrize("q", POSTURES)
def test_inertia_is_the_sum_over_the_links(arm, model, q):
    # kinetic energy: sum of m |v|^2 / 2 + w.I w / 2 over the links, and the motors' armature
    data, expected = placed(model, q), 0.1 * np.eye(4)
    columns = [model.joint(joint).dofadr[0] for joint in ARM_JOINTS]
    for link in LINKS:
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacBodyCom(model, data, linear, angular, model.body(link).id)
        axes = data.body(link).ximat.reshape(3, 3)
        tensor = axes @ np.diag(model.body(link).inertia) @ axes.T
        v, w = linear[:, columns], angular[:, columns]
        expected += model.body(link).mass * v.T @ v + w.T @ tensor @ w
    np.testing.assert_allclose(arm.at(q).inertia, expected, atol=1e-10)


@pytest.mark.parametrize("q", POSTURES)
def test_gravity_is_the_slope_of_the_potential_energy(arm, model, q):
    def energy(posture):
        data = placed(model, posture)
        return 9.81 * sum(model.body(k).mass[0] * data.body(k).xipos[2] for k in LINKS)

    np.testing.assert_allclose(arm.at(q).gravity, differences(energy, q), atol=1e-6)


@pytest.mark.parametrize("q", POSTURES)
def test_task_inertia_is_the_damped_inverse_of_the_mobility(arm, q):
    terms = arm.at(q)
    mobility = terms.jacobian @ np.linalg.inv(terms.inertia) @ terms.jacobian.T
    largest = np.linalg.eigvalsh(mobility)[-1]
    # s / (s^2 + c^2) on the eigenvalues is A (A^2 + c^2 I)^-1 on the matrix
    expected = mobility @ np.linalg.inv(mobility @ mobility + (0.02 * largest) ** 2 * np.eye(3))
    np.testing.assert_allclose(terms.task_inertia, expected, rtol=1e-7, atol=1e-9)


def test_task_inertia_stays_finite_where_the_arm_is_stretched(arm):
    # Elbow at 90 degrees: upper arm and forearm in one line but for the elbow's small offset.
    terms = arm.at([0, 0, 0, 1.5708])
    mobility = terms.jacobian @ np.linalg.inv(terms.inertia) @ terms.jacobian.T
    s = np.linalg.eigvalsh(mobility)
    assert s[0] < 0.02 * s[-1]
    bound = 1 / (2 * 0.02 * s[-1])  # the largest value of s / (s^2 + c^2) is 1 / (2 c)
    damped = np.linalg.eigvalsh(terms.task_inertia)
    assert damped[-1] <= bound * (1 + 1e-9)
    assert 1 / s[0] > 2 * damped[-1]


def test_batch_stacks_single_postures(arm):
    stacked = arm.batch(POSTURES)
    for i, q in enumerate(POSTURES):
        for many, one in zip(stacked, arm.at(q), strict=True):
            np.testing.assert_array_equal(many[i], one)


def test_an_empty_batch_has_empty_terms(arm):
    shapes = [term.shape for term in arm.batch(np.empty((0, 4)))]
    assert shapes == [(0, 3), (0, 3, 4), (0, 4, 4), (0, 3, 3), (0, 4)]


def test_limits_are_the_joint_ranges_of_the_arm(arm):
    assert arm.limits_rad.tolist() == [[-2.87, 2.87], [-3.11, 0.34], [-4.45, 1.3], [-1.25, 2.61]]


def test_postures_of_wrong_shape_are_refused(arm):
    with pytest.raises(UsageError) as error:
        arm.at(np.zeros(3))
    assert str(error.value) == "q: its shape is (3,); the right arm's postures are (4,)"
    with pytest.raises(UsageError) as error:
        arm.batch(np.zeros(4))
    assert str(error.value) == "q: its shape is (4,); the right arm's postures are (n, 4)"
