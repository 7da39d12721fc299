import numpy as np
import pytest

from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.belief import PLACE, Belief, corrected
from spikeport.robot.estimator.external_fix import FixNoise, fixed
from spikeport.robot.estimator.torso import IMU_OFFSET_M
from tests.helpers.beliefs import moved_by, random_belief, slope

WAIST_RAD = 0.3
NOISE = FixNoise()


def upright(seed: int) -> Belief:
    """Return a belief of a nearly upright robot, so that its heading is well defined."""
    belief = random_belief(seed)
    turned = torso.rotation(np.array([1.0, 0.1, -0.1, 0.5 * seed]))
    return belief._replace(pose=belief.pose._replace(rotation=turned))


def pelvis(belief: Belief) -> tuple[np.ndarray, float]:
    """Return place and heading of the pelvis."""
    rotation, vectors = belief.pose
    heading = torso.heading_rad(torso.pelvis_rotation(rotation, WAIST_RAD))
    return vectors[PLACE] - rotation @ IMU_OFFSET_M, heading


@pytest.mark.parametrize("seed", range(4))
def test_a_fix_at_the_believed_pose_has_no_innovation(seed):
    belief = upright(seed)
    found = fixed(belief, Fix(*pelvis(belief)), WAIST_RAD, NOISE)
    np.testing.assert_allclose(found.innovation, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.diag(found.noise), [1e-4, 1e-4, 1e-4, 4e-4])


@pytest.mark.parametrize("yaw_rad", [None, 0.1])
@pytest.mark.parametrize("seed", range(4))
def test_the_sensitivity_is_the_derivative_of_the_innovation(seed, yaw_rad):
    belief = upright(seed)
    fix = Fix(np.array([0.3, 0.2, 0.9]), yaw_rad)

    def innovation(delta: np.ndarray) -> np.ndarray:
        return fixed(moved_by(belief, delta), fix, WAIST_RAD, NOISE).innovation

    found = fixed(belief, fix, WAIST_RAD, NOISE)
    assert len(found.innovation) == (3 if yaw_rad is None else 4)
    np.testing.assert_allclose(found.sensitivity, -slope(innovation), atol=1e-8)


def test_the_innovation_of_the_heading_is_less_than_half_a_turn():
    belief = upright(0)
    place, heading = pelvis(belief)
    found = fixed(belief, Fix(place, heading + 2 * np.pi - 0.1), WAIST_RAD, NOISE)
    assert found.innovation[3] == pytest.approx(-0.1)


def test_precise_fixes_move_the_belief_to_the_fix():
    belief = upright(1)
    place, heading = pelvis(belief)
    fix = Fix(place + np.array([0.05, -0.03, 0.02]), heading + 0.04)
    for _ in range(3):
        belief = corrected(belief, fixed(belief, fix, WAIST_RAD, FixNoise(1e-6, 1e-6)))
    np.testing.assert_allclose(pelvis(belief)[0], fix.position, atol=1e-3)
    assert pelvis(belief)[1] == pytest.approx(fix.yaw_rad, abs=1e-3)
