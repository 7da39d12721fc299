"""Contacts of a belief: points of the soles that stand still in the world.

A point is at R h(q) + p. It is added as it begins to stand, corrects the belief as long as it does,
and is forgotten when it leaves the floor. Source: Hartley et al. 2020 (see `group`), on forward
kinematics and on contacts that come and go; `rolled` and `level` are ours.
"""

from typing import NamedTuple

import numpy as np

from spikeport.robot.estimator.belief import (
    FIRST_CONTACT,
    N_ERRORS,
    PLACE,
    ROTATION,
    Belief,
    Observation,
    errors_of,
)
from spikeport.robot.estimator.group import Pose, hat

_EYE = np.eye(3)


class Points(NamedTuple):
    """Points of the soles in the IMU's frame, by the joints.

    Attributes
    ----------
    places : ndarray, (4, 3)
        h(q), m.
    covariances : ndarray, (4, 3, 3)
        J cov(q) J^T plus the variance by which soles yield, m^2.
    """

    places: np.ndarray
    covariances: np.ndarray


def standing_still(belief: Belief, points: Points, contacts: np.ndarray) -> Observation:
    """Return the observation of standing points, for contacts (4,) of bool: z = R h + p - d.

    H = -I for the place and I for the contact: a correction of the place moves the foot, and one
    of the contact moves the contact. The noise is R J cov(q) J^T R^T. Source: the paper's forward
    kinematic measurement.
    """
    chosen = np.flatnonzero(contacts)
    rotation, vectors = belief.pose
    innovation = points.places[chosen] @ rotation.T + vectors[PLACE]
    innovation -= vectors[FIRST_CONTACT + chosen]
    sensitivity = np.zeros((3 * len(chosen), N_ERRORS))
    noise = np.zeros((3 * len(chosen), 3 * len(chosen)))
    for i, contact in enumerate(chosen.tolist()):
        rows = slice(3 * i, 3 * i + 3)
        sensitivity[rows, errors_of(PLACE)] = -_EYE
        sensitivity[rows, errors_of(FIRST_CONTACT + contact)] = _EYE
        noise[rows, rows] = rotation @ points.covariances[contact] @ rotation.T
    return Observation(innovation.ravel(), sensitivity, noise)


def level(
    belief: Belief, contacts: np.ndarray, heights_m: np.ndarray, deviation_m: float
) -> Observation:
    """Return the observation that contacts (4,) of bool are on a level floor: z = height - d_z.

    A correction delta moves d_z by (delta_d + delta_R x d)_z. ``heights_m`` (4,) are the
    world heights of the shapes' centres on that floor; ``deviation_m`` is their standard deviation.
    """
    chosen = np.flatnonzero(contacts)
    places = belief.pose.vectors[FIRST_CONTACT + chosen]
    sensitivity = np.zeros((len(chosen), N_ERRORS))
    for row, (contact, place) in enumerate(zip(chosen.tolist(), places, strict=True)):
        sensitivity[row, ROTATION] = -hat(place)[2]
        sensitivity[row, errors_of(FIRST_CONTACT + contact).start + 2] = 1.0
    noise = deviation_m**2 * np.eye(len(chosen))
    return Observation(heights_m[chosen] - places[:, 2], sensitivity, noise)


def forgotten(belief: Belief, contacts: np.ndarray) -> Belief:
    """Return a belief without some contacts, ``(4,)`` of bool."""
    if not contacts.any():
        return belief
    vectors, covariance = belief.pose.vectors.copy(), belief.covariance.copy()
    for contact in np.flatnonzero(contacts).tolist():
        vectors[FIRST_CONTACT + contact] = 0.0
        covariance[errors_of(FIRST_CONTACT + contact)] = 0.0
        covariance[:, errors_of(FIRST_CONTACT + contact)] = 0.0
    return belief._replace(pose=Pose(belief.pose.rotation, vectors), covariance=covariance)


def added(belief: Belief, points: Points, contacts: np.ndarray) -> Belief:
    """Return a belief with contacts, ``(4,)`` of bool, that stand from now on.

    d = R h + p, xi_d = xi_p + R J w_q: the new error is the place's plus the joints'.
    Source: the paper's addition of contacts.
    """
    rotation, vectors = belief.pose.rotation, belief.pose.vectors.copy()
    grown = np.eye(N_ERRORS)
    extra = np.zeros((N_ERRORS, N_ERRORS))
    for contact in np.flatnonzero(contacts).tolist():
        place = errors_of(FIRST_CONTACT + contact)
        vectors[FIRST_CONTACT + contact] = rotation @ points.places[contact] + vectors[PLACE]
        # The row of the identity would keep the error of the contact that was there before.
        grown[place] = 0.0
        grown[place, errors_of(PLACE)] = _EYE
        extra[place, place] = rotation @ points.covariances[contact] @ rotation.T
    covariance = grown @ belief.covariance @ grown.T + extra
    return belief._replace(pose=Pose(rotation, vectors), covariance=covariance)


def rolled(belief: Belief, displacements: np.ndarray) -> Belief:
    """Return a belief whose contacts have rolled by (4, 3) m in the world."""
    vectors = belief.pose.vectors.copy()
    vectors[FIRST_CONTACT:] += displacements
    return belief._replace(pose=Pose(belief.pose.rotation, vectors))
