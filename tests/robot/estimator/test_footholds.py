import numpy as np
import pytest

from spikeport.robot.estimator import footholds
from spikeport.robot.estimator.belief import (
    FIRST_CONTACT,
    N_ERRORS,
    PLACE,
    Belief,
    corrected,
    errors_of,
)
from spikeport.robot.estimator.footholds import Points
from tests.helpers.beliefs import moved_by, random_belief, slope

CONTACTS = np.array([True, False, True, False])


def points_of(belief: Belief) -> Points:
    """Return points at the places that the belief has for them, known to 1 mm."""
    vectors = belief.pose.vectors
    apart = vectors[FIRST_CONTACT:] - vectors[PLACE]
    return Points(apart @ belief.pose.rotation, np.tile(1e-6 * np.eye(3), (4, 1, 1)))


@pytest.mark.parametrize("seed", range(3))
def test_points_at_their_believed_places_have_no_innovation(seed):
    belief = random_belief(seed)
    found = footholds.standing_still(belief, points_of(belief), CONTACTS)
    np.testing.assert_allclose(found.innovation, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.noise, 1e-6 * np.eye(6), atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_sensitivity_of_points_is_the_derivative(seed):
    belief = random_belief(seed)
    points = points_of(belief)

    def innovation(delta: np.ndarray) -> np.ndarray:
        return footholds.standing_still(moved_by(belief, delta), points, CONTACTS).innovation

    found = footholds.standing_still(belief, points, CONTACTS).sensitivity
    np.testing.assert_allclose(found, -slope(innovation), atol=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_the_sensitivity_of_heights_is_the_derivative(seed):
    belief, heights = random_belief(seed), np.arange(4.0)

    def innovation(delta: np.ndarray) -> np.ndarray:
        return footholds.level(moved_by(belief, delta), CONTACTS, heights, 0.1).innovation

    found = footholds.level(belief, CONTACTS, heights, 0.1)
    np.testing.assert_allclose(found.sensitivity, -slope(innovation), atol=1e-8)
    places = belief.pose.vectors[FIRST_CONTACT:][CONTACTS]
    np.testing.assert_allclose(found.innovation, heights[CONTACTS] - places[:, 2])
    np.testing.assert_allclose(found.noise, 0.01 * np.eye(2))


def test_an_added_contact_is_at_the_foot_and_shares_the_error_of_the_place():
    belief = random_belief(0)
    points = Points(np.random.RandomState(0).standard_normal((4, 3)), points_of(belief).covariances)
    empty = footholds.forgotten(belief, np.ones(4, dtype=bool))
    found = footholds.added(empty, points, CONTACTS)
    rotation, vectors = found.pose
    expected = points.places[CONTACTS] @ rotation.T + vectors[PLACE]
    np.testing.assert_allclose(vectors[FIRST_CONTACT:][CONTACTS], expected, atol=1e-12)
    assert not vectors[FIRST_CONTACT:][~CONTACTS].any()
    place, first, third = errors_of(PLACE), errors_of(FIRST_CONTACT), errors_of(FIRST_CONTACT + 2)
    covariance = found.covariance
    np.testing.assert_allclose(covariance[first, third], covariance[place, place])
    np.testing.assert_allclose(
        covariance[first, first], covariance[place, place] + 1e-6 * np.eye(3), atol=1e-15
    )
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-15)


def test_forgetting_contacts_leaves_the_others_as_they_are():
    belief = random_belief(1)
    found = footholds.forgotten(belief, CONTACTS)
    assert not found.pose.vectors[FIRST_CONTACT:][CONTACTS].any()
    kept = np.ones(N_ERRORS, dtype=bool)
    for contact in np.flatnonzero(CONTACTS):
        kept[errors_of(FIRST_CONTACT + contact)] = False
    assert not found.covariance[~kept].any()
    np.testing.assert_array_equal(
        found.covariance[np.ix_(kept, kept)], belief.covariance[np.ix_(kept, kept)]
    )


def test_a_standing_foot_that_seems_to_move_moves_the_robot():
    """If a standing foot is 1 cm further behind, the robot is 1 cm further ahead."""
    belief = random_belief(2)
    place = errors_of(PLACE)
    belief.covariance[:] = 1e-8 * np.eye(N_ERRORS)
    belief.covariance[place, place] = np.eye(3)
    points = points_of(belief)
    behind = np.array([-0.01, 0.0, 0.0])
    moved = points._replace(places=points.places + behind @ belief.pose.rotation)
    after = corrected(belief, footholds.standing_still(belief, moved, CONTACTS))
    ahead = after.pose.vectors[PLACE] - belief.pose.vectors[PLACE]
    np.testing.assert_allclose(ahead, -behind, atol=1e-5)


def test_rolling_moves_the_contacts_alone():
    belief = random_belief(0)
    by = np.random.RandomState(0).standard_normal((4, 3))
    found = footholds.rolled(belief, by)
    before = belief.pose.vectors
    np.testing.assert_allclose(found.pose.vectors[FIRST_CONTACT:], before[FIRST_CONTACT:] + by)
    np.testing.assert_array_equal(found.pose.vectors[:FIRST_CONTACT], before[:FIRST_CONTACT])
