"""Contacts of a belief: points of the soles that stand still in the world.

A point is at R h(q) + p. It is added as it begins to stand, corrects the belief as long as it does,
and is forgotten when it leaves the floor. Source: Hartley et al. 2020 (see `group`), on forward
kinematics and on contacts that come and go; `rolled` and `levelled` are ours.
"""

from typing import NamedTuple

import numpy as np

from spikeport.robot.estimator.belief import (
    FIRST_CONTACT,
    N_ERRORS,
    PLACE,
    ROTATION,
    Belief,
    corrected,
    errors_of,
)
from spikeport.robot.estimator.group import Pose, hat


class Points(NamedTuple):
    """Points of the soles in the IMU's frame, as the joints say.

    Attributes
    ----------
    places : ndarray, (4, 3)
        h(q), m.
    covariances : ndarray, (4, 3, 3)
        J cov(q) J^T, m^2, and what the shape gives way.
    """

    places: np.ndarray
    covariances: np.ndarray


def observed(belief: Belief, points: Points, standing: np.ndarray) -> Belief:
    """Correct a belief by points that stand: z = R h + p - d, noise R J cov(q) J^T R^T.

    H = -I for the place and I for the contact: a correction moves the foot as the place, and the
    contact as itself. Source: the paper's forward kinematic measurement.
    """
    contacts = np.flatnonzero(standing)
    if not len(contacts):
        return belief
    rotation, vectors = belief.pose
    innovation = points.places[contacts] @ rotation.T + vectors[PLACE]
    innovation -= vectors[FIRST_CONTACT + contacts]
    sensitivity = np.zeros((3 * len(contacts), N_ERRORS))
    noise = np.zeros((3 * len(contacts), 3 * len(contacts)))
    for i, contact in enumerate(contacts.tolist()):
        rows = slice(3 * i, 3 * i + 3)
        sensitivity[rows, errors_of(PLACE)] = -np.eye(3)
        sensitivity[rows, errors_of(FIRST_CONTACT + contact)] = np.eye(3)
        noise[rows, rows] = rotation @ points.covariances[contact] @ rotation.T
    return corrected(belief, innovation.ravel(), sensitivity, noise)


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

    d = R h + p, xi_d = xi_p + R J w_q: the new error is the place's, and the joints'.
    Source: the paper's addition of contacts.
    """
    if not contacts.any():
        return belief
    rotation, vectors, covariance = (
        belief.pose.rotation,
        belief.pose.vectors.copy(),
        belief.covariance,
    )
    grown = np.eye(N_ERRORS)
    extra = np.zeros((N_ERRORS, N_ERRORS))
    for contact in np.flatnonzero(contacts).tolist():
        place = errors_of(FIRST_CONTACT + contact)
        vectors[FIRST_CONTACT + contact] = rotation @ points.places[contact] + vectors[PLACE]
        grown[place, errors_of(PLACE)] = np.eye(3)
        extra[place, place] = rotation @ points.covariances[contact] @ rotation.T
    return belief._replace(
        pose=Pose(rotation, vectors), covariance=grown @ covariance @ grown.T + extra
    )


def rolled(belief: Belief, displacements: np.ndarray) -> Belief:
    """Return a belief whose contacts have rolled by (4, 3) m in the world."""
    vectors = belief.pose.vectors.copy()
    vectors[FIRST_CONTACT:] += displacements
    return belief._replace(pose=Pose(belief.pose.rotation, vectors))


def levelled(
    belief: Belief, contacts: np.ndarray, heights_m: np.ndarray, deviation_m: float
) -> Belief:
    """Correct a belief by contacts (4,) of bool on a level floor.

    z = height - d_z, which a correction delta changes by (delta_d + delta_R x d)_z.

    ``heights_m`` (4,) are those of their shapes' centres above the floor; ``deviation_m`` is the
    standard deviation of a height.
    """
    chosen = np.flatnonzero(contacts)
    if not len(chosen):
        return belief
    places = belief.pose.vectors[FIRST_CONTACT + chosen]
    innovation = heights_m[chosen] - places[:, 2]
    sensitivity = np.zeros((len(chosen), N_ERRORS))
    for row, (contact, place) in enumerate(zip(chosen.tolist(), places, strict=True)):
        sensitivity[row, ROTATION] = -hat(place)[2]
        sensitivity[row, errors_of(FIRST_CONTACT + contact).start + 2] = 1.0
    return corrected(belief, innovation, sensitivity, deviation_m**2 * np.eye(len(chosen)))
