import numpy as np
import pytest

from spikeport.robot.estimator import group
from spikeport.robot.estimator.belief import (
    ACCELEROMETER_BIAS,
    FIRST_CONTACT,
    GYROSCOPE_BIAS,
    N_ERRORS,
    PLACE,
    ROTATION,
    VELOCITY,
    errors_of,
)
from spikeport.robot.estimator.propagation import (
    FREE_FALL_M_S2,
    ImuNoise,
    growth,
    moved,
    propagated,
    transition,
)
from tests.helpers.beliefs import difference, moved_by, random_belief, slope
from tests.helpers.lie_group import adjoint

OMEGA, FORCE = np.array([0.5, -1.0, 2.0]), np.array([1.0, -2.0, 10.0])
STANDING = np.array([True, False, True, True])
NOISE = ImuNoise()


def test_one_long_step_of_a_pose_equals_many_small_ones():
    pose, n = random_belief(0).pose, 20_000
    whole, small = moved(pose, OMEGA, FORCE, 0.1), pose
    rotation, (velocity, place) = pose.rotation, pose.vectors[:2].copy()
    turn = group.gammas(OMEGA * 0.1 / n)[0]
    for _ in range(n):
        place = place + velocity * 0.1 / n
        velocity = velocity + (rotation @ FORCE + FREE_FALL_M_S2) * 0.1 / n
        rotation = rotation @ turn
    np.testing.assert_allclose(whole.rotation, rotation, atol=1e-9)
    np.testing.assert_allclose(whole.vectors[VELOCITY], velocity, atol=1e-4)
    np.testing.assert_allclose(whole.vectors[PLACE], place, atol=1e-5)
    np.testing.assert_array_equal(whole.vectors[FIRST_CONTACT:], small.vectors[FIRST_CONTACT:])


def test_an_imu_at_rest_stays():
    pose = random_belief(1).pose
    pose.vectors[VELOCITY] = 0.0
    after = moved(pose, np.zeros(3), -pose.rotation.T @ FREE_FALL_M_S2, 0.1)
    np.testing.assert_allclose(after.vectors, pose.vectors, atol=1e-12)


@pytest.mark.parametrize(("dt_s", "atol"), [(0.005, 2e-3), (0.0005, 2e-5)])
@pytest.mark.parametrize("seed", range(3))
def test_the_transition_is_the_derivative_of_errors_up_to_the_second_order(seed, dt_s, atol):
    belief = random_belief(seed)

    def after(error: np.ndarray) -> np.ndarray:
        results = []
        for start in (moved_by(belief, error), belief):
            omega, force = OMEGA - start.gyroscope_bias, FORCE - start.accelerometer_bias
            results.append(start._replace(pose=moved(start.pose, omega, force, dt_s)))
        return difference(*results)

    np.testing.assert_allclose(transition(belief, dt_s), slope(after), atol=atol)


def test_a_tilt_error_grows_into_velocity_and_place_by_gravity():
    """g dt for the velocity, and g dt^2 / 2 for the place."""
    belief, dt_s = random_belief(0), 0.1
    phi = transition(belief, dt_s)
    pull = group.hat(FREE_FALL_M_S2)
    np.testing.assert_allclose(phi[errors_of(VELOCITY), ROTATION], pull * dt_s)
    np.testing.assert_allclose(phi[errors_of(PLACE), ROTATION], pull * dt_s**2 / 2)


def test_biases_are_subtracted_from_the_imus_measurements():
    belief = random_belief(2)
    biases = {"gyroscope_bias": OMEGA / 10, "accelerometer_bias": FORCE / 10}
    args = OMEGA, FORCE, STANDING, 0.1, NOISE
    found = propagated(belief._replace(**biases), *args).pose
    wanted = moved(belief.pose, 0.9 * OMEGA, 0.9 * FORCE, 0.1)
    np.testing.assert_allclose(found.rotation, wanted.rotation)
    np.testing.assert_allclose(found.vectors, wanted.vectors)


def test_without_biases_the_transition_of_errors_is_the_same_in_every_state():
    """The reason for an invariant filter: autonomous errors."""
    n = GYROSCOPE_BIAS.start
    one, other = transition(random_belief(0), 0.01), transition(random_belief(1), 0.01)
    np.testing.assert_array_equal(one[:n, :n], other[:n, :n])


def test_growth_is_the_sensors_noise_moved_by_the_adjoint():
    belief = random_belief(2)
    isotropic = ImuNoise(0.1, 0.2, 0.3, 0.4, slip=0.5, sinking=0.5)
    sizes = np.zeros(N_ERRORS)
    sizes[ROTATION], sizes[errors_of(VELOCITY)] = 0.1, 0.2
    for contact in np.flatnonzero(STANDING):
        sizes[errors_of(FIRST_CONTACT + contact)] = 0.5
    sizes[GYROSCOPE_BIAS], sizes[ACCELEROMETER_BIAS] = 0.3, 0.4
    moving = np.eye(N_ERRORS)
    moving[: GYROSCOPE_BIAS.start, : GYROSCOPE_BIAS.start] = adjoint(belief.pose)
    expected = moving @ np.diag(sizes**2) @ moving.T
    np.testing.assert_allclose(growth(belief, STANDING, isotropic), expected, atol=1e-12)


def test_contacts_sink_across_the_floor_and_slip_along_it():
    belief = random_belief(0)
    noise = ImuNoise(gyroscope=0.0, slip=0.1, sinking=0.3)
    found = np.diag(growth(belief, STANDING, noise))
    np.testing.assert_allclose(found[errors_of(FIRST_CONTACT)], [0.01, 0.01, 0.09])
    np.testing.assert_array_equal(found[errors_of(FIRST_CONTACT + 1)], 0.0)


def test_a_contact_that_does_not_stand_gets_no_error():
    belief = random_belief(0)
    gone = errors_of(FIRST_CONTACT + 1)
    belief.pose.vectors[FIRST_CONTACT + 1] = 0.0
    belief.covariance[gone] = belief.covariance[:, gone] = 0.0
    after = propagated(belief, OMEGA, FORCE, STANDING, 0.005, NOISE)
    assert not after.covariance[gone].any()
    assert not after.covariance[:, gone].any()
    assert not after.pose.vectors[FIRST_CONTACT + 1].any()
