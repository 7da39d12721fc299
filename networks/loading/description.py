"""The environment of a walking policy's training, and its translation to another robot's.

    observation = [head, q - q_default, dq, last action],    target = q_default + s action

With p, s of the policy and p', s' of the robot, in the robot's order of joints:

    q - p = (q - p') + (p' - p),    a = (s' a' + p' - p) / s,    a' = (s a + p - p') / s'

so that weights and biases of the first and last layer take up every difference.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from spikeport.networks.loading.mlp import Mlp, checked
from spikeport.networks.policy_values import Layer
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.reading.mismatch import MismatchError

HEAD = 12
"""Linear and angular velocity, gravity, command: three numbers each."""


@dataclass(frozen=True, eq=False)
class Description:
    """A robot's joints, their properties by name, and the time between actions.

    Attributes
    ----------
    joints : tuple of str
        The joints in the order of observations and actions.
    pose_rad : mapping
        The target pose of the zero action; observed angles are relative to it.
    gains : mapping
        The gains of the position control: (kp, kd) in N m/rad and N m s/rad.
    action_scale_rad : mapping
        Change of a joint's target for an action of 1.
    control_dt_s : float
        Time from one action to the next.
    observation_scale : ndarray, (12 + 3 joints,) or ()
        Factor of every observation.
    """

    joints: tuple[str, ...]
    pose_rad: Mapping[str, float]
    gains: Mapping[str, tuple[float, float]]
    action_scale_rad: Mapping[str, float]
    control_dt_s: float
    observation_scale: ArrayLike = 1.0


def translated(mlp: Mlp, theirs: Description, ours: Description) -> WalkingPolicy:
    """Return the policy for our robot from a perceptron made for another robot ("theirs").

    Parameters
    ----------
    mlp : Mlp
        The perceptron, with observations and actions in their order of joints.
    theirs, ours : Description
        Their robot, which `check_robot` passed, and ours, which has one action scale for all
        joints.

    Raises
    ------
    MismatchError
        The perceptron has another shape or activation, or functions around its layers.
    """
    _check_shape(mlp, len(ours.joints))
    (p, s), (p_ours, s_ours) = (_pose_and_scale(one, ours.joints) for one in (theirs, ours))
    order = [theirs.joints.index(joint) for joint in ours.joints]
    # With q the joint angles, a target, p the pose and s the scale, a policy observes q - p and its
    # last action (a - p) / s: theirs are ours, shifted by p' - p and scaled by s' / s.
    shift, ratio = p_ours - p, s_ours / s
    head, q, dq, action = _parts(mlp.layers[0].weights * theirs.observation_scale, order)
    first = np.hstack((head, q, dq, action * ratio))
    # The last action shifts as the angles do, in its own units.
    first_bias = mlp.layers[0].bias + (q + action / s) @ shift
    last, last_bias = mlp.layers[-1].weights[order], mlp.layers[-1].bias[order]
    layers = (
        Layer(first, first_bias),
        *mlp.layers[1:-1],
        Layer(last / ratio[:, np.newaxis], (last_bias - shift / s) / ratio),
    )
    checked(layers, (mlp.activation,))
    weights, biases = zip(*((layer.weights, layer.bias) for layer in layers), strict=True)
    return WalkingPolicy(weights, biases, ours.joints, p_ours, float(s_ours[0]))


def translated_observations(
    observations: np.ndarray, theirs: Description, ours: Description
) -> np.ndarray:
    """Return the observations, (n, 12 + 3 joints), that our robot makes in place of theirs."""
    (p, s), (p_ours, s_ours) = (_pose_and_scale(one, ours.joints) for one in (theirs, ours))
    order = [theirs.joints.index(joint) for joint in ours.joints]
    scale = np.broadcast_to(theirs.observation_scale, observations.shape)
    # A scale of 0 hides a value, so that any one will do.
    plain = np.divide(observations, scale, out=np.zeros_like(observations), where=scale != 0)
    head, q, dq, action = _parts(plain, order)
    # With differences first, the observations of an equal robot keep every bit.
    shift = p - p_ours
    return np.hstack((head, q + shift, dq, s / s_ours * action + shift / s_ours))


def _pose_and_scale(robot: Description, joints: Sequence[str]) -> Iterator[np.ndarray]:
    for values in (robot.pose_rad, robot.action_scale_rad):
        yield np.array([values[joint] for joint in joints])


def _parts(columns: np.ndarray, order: list[int]) -> list[np.ndarray]:
    """Return columns of head, angles, velocities and last action, with the joints reordered."""
    n = len(order)
    head, *parts = np.split(columns, [HEAD, HEAD + n, HEAD + 2 * n], axis=1)
    return [head, *(part[:, order] for part in parts)]


def _check_shape(mlp: Mlp, n_joints: int) -> None:
    if mlp.activation != "elu":
        raise MismatchError("activation elu", mlp.activation)
    if mlp.observed is not None:
        raise MismatchError("an observation without a clip", "one with a clip")
    if mlp.squash is not None:
        raise MismatchError("a linear last layer", f"{mlp.squash.words} behind it")
    wanted, found = (HEAD + 3 * n_joints, n_joints), (mlp.sizes[0], mlp.sizes[-1])
    if found != wanted:
        in_words = ("{} observations and {} actions".format(*sizes) for sizes in (wanted, found))
        raise MismatchError(*in_words)


def check_robot(theirs: Description, ours: Description) -> None:
    """Refuse a robot that differs from ours in a way that weights cannot make up for.

    Raises
    ------
    MismatchError
        Joints, gains or the time between actions differ, or a pose or scale is not a finite number.
    """
    if sorted(theirs.joints) != sorted(ours.joints):
        foreign = [joint for joint in theirs.joints if joint not in ours.joints]
        found = f"{len(theirs.joints)} joints, foreign: {', '.join(foreign) or 'none'}"
        raise MismatchError(f"the joints {', '.join(ours.joints)}", found)
    if not np.isclose(theirs.control_dt_s, ours.control_dt_s):
        raise MismatchError(
            f"an action every {ours.control_dt_s:g} s", f"{theirs.control_dt_s:g} s"
        )
    if not np.isfinite(theirs.observation_scale).all():
        raise MismatchError("finite scales of the observation", "NaN or infinity")
    for joint, gains in ours.gains.items():
        pose, scale = theirs.pose_rad[joint], theirs.action_scale_rad[joint]
        if not np.isfinite(pose):
            raise MismatchError(f"a finite default pose of {joint}", f"{pose:g}")
        if not 0 < scale < np.inf:
            raise MismatchError(f"a finite action scale above 0 of {joint}", f"{scale:g}")
        if not np.allclose(theirs.gains[joint], gains):
            wanted, found = ("kp {:g}, kd {:g}".format(*g) for g in (gains, theirs.gains[joint]))
            raise MismatchError(f"gains {wanted} of {joint}", found)
