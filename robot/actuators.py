"""The switch of a joint's actuator between torque and position control while the robot runs.

An actuator's torque is ``gain ctrl + bias . (1, q, dq)``, clipped to the torque limit:

=========  =====  =============  ===========
mode       gain   bias           ctrl
=========  =====  =============  ===========
torque     1      (0, 0, 0)      torque, N m
position   kp     (0, -kp, -kd)  target, rad
=========  =====  =============  ===========

Source: MuJoCo documentation, "Actuation model".
"""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from spikeport.errors import UsageError, unknown
from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco

_LAW = 3
"""Number of the bias parameters of an actuator that a mode sets."""
_INDEX = {joint: index for index, joint in enumerate(JOINTS)}


def indices(joints: Sequence[str]) -> np.ndarray:
    """Return the indices of joints in a joint vector; raise UsageError for an unknown name."""
    return _indices(tuple(joints))


@functools.cache
def _indices(joints: tuple[str, ...]) -> np.ndarray:
    for joint in joints:
        if joint not in _INDEX:
            raise unknown("joint", joint, JOINTS)
    places = np.array([_INDEX[joint] for joint in joints], dtype=np.intp)
    places.setflags(write=False)
    return places


def values(what: str, numbers: ArrayLike, joints: Sequence[str]) -> np.ndarray:
    """Return one finite number per joint, ``(n,)``; a single number applies to all joints.

    Raises
    ------
    UsageError
        The shape does not match the joints, or a number is not finite.
    """
    array = np.asarray(numbers, dtype=float)
    if array.shape not in ((), (len(joints),)):
        raise UsageError(
            f"{what}: shape {array.shape} for {len(joints)} joints; give one number per joint"
        )
    array = array if array.ndim else np.full(len(joints), array)
    finite = np.isfinite(array)
    if np.count_nonzero(finite) < len(finite):
        first = int(np.argmin(finite))
        raise UsageError(f"{what}: {array[first]} for joint '{joints[first]}'; give finite numbers")
    return array


def set_torque_mode(model: mujoco.MjModel, index: np.ndarray) -> None:
    """Make ``ctrl`` of these actuators a torque in N m."""
    model.actuator_gainprm[index, 0] = 1.0
    model.actuator_biasprm[index, :_LAW] = 0.0


def set_position_mode(
    model: mujoco.MjModel, index: np.ndarray, kp: np.ndarray, kd: np.ndarray
) -> None:
    """Make ``ctrl`` of these actuators a target angle in rad, with gains in N m/rad, N m s/rad."""
    model.actuator_gainprm[index, 0] = kp
    model.actuator_biasprm[index, 0] = 0.0
    model.actuator_biasprm[index, 1] = -kp
    model.actuator_biasprm[index, 2] = -kd


class ActuatorCommand(NamedTuple):
    """A command to all actuators, with the gains and biases of their modes."""

    ctrl: np.ndarray
    gain: np.ndarray
    bias: np.ndarray

    @classmethod
    def of(cls, model: mujoco.MjModel, data: mujoco.MjData) -> "ActuatorCommand":
        """Return a copy of the present command."""
        bias = model.actuator_biasprm[:, :_LAW]
        return cls(data.ctrl.copy(), model.actuator_gainprm[:, 0].copy(), bias.copy())

    def set_on(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Set this command in a simulation."""
        data.ctrl[:] = self.ctrl
        model.actuator_gainprm[:, 0] = self.gain
        model.actuator_biasprm[:, :_LAW] = self.bias
