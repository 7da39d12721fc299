"""Kinematics and dynamics of the right arm, as MuJoCo computes them.

With the torso upright, the pelvis at (0, 0, 1.06) m and every other joint in its default pose:

    tau = M(q) ddq + gravity(q)                         (at rest, dq = 0)
    M_x = V diag(s / (s^2 + (0.02 s_max)^2)) V^T        J M^-1 J^T = V diag(s) V^T

Source: Khatib, "A unified approach for motion and force control of robot manipulators: the
operational space formulation", 1987; the damping keeps M_x finite where the arm is stretched.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from spikeport.errors import UsageError
from spikeport.robot.description import ARM_JOINTS, POSE_RAD, load
from spikeport.robot.engine import mujoco

TASK_DAMPING = 0.02
"""Share of the largest singular value of J M^-1 J^T at which its inverse is damped."""


class H1ArmTerms(NamedTuple):
    """The terms of the arm's dynamics for a controller; ``...`` is empty or the number of poses.

    Attributes
    ----------
    position : ndarray, (..., 3)
        Site ``right_hand`` in the world frame, m.
    jacobian : ndarray, (..., 3, 4)
        d position / d q, m/rad.
    inertia : ndarray, (..., 4, 4)
        Joint-space inertia M with armature, kg m^2.
    task_inertia : ndarray, (..., 3, 3)
        Damped M_x = (J M^-1 J^T)^-1, kg.
    gravity : ndarray, (..., 4)
        The holding torque: applied at rest, it keeps the arm where it is, N m.
    """

    position: np.ndarray
    jacobian: np.ndarray
    inertia: np.ndarray
    task_inertia: np.ndarray
    gravity: np.ndarray


class ArmDynamics:
    """The right arm's terms at any posture, computed in a simulation of its own."""

    def __init__(self) -> None:
        self._model = load()
        self._data = mujoco.MjData(self._model)
        self._data.qpos[7:] = POSE_RAD
        self._site = self._model.site("right_hand").id
        joints = [self._model.joint(joint) for joint in ARM_JOINTS]
        self._joints = [joint.id for joint in joints]
        self._qpos = np.array([joint.qposadr[0] for joint in joints])
        self._dof = np.array([joint.dofadr[0] for joint in joints])

    @property
    def limits_rad(self) -> np.ndarray:
        """Lowest and highest angle of each joint, ``(4, 2)``."""
        return np.array(self._model.jnt_range[self._joints])

    def at(self, q: ArrayLike) -> H1ArmTerms:
        """Return the terms at a posture ``q (4,)`` in rad; UsageError for another shape."""
        posture = _shaped(q, (4,))
        return H1ArmTerms(*(term[0] for term in self.batch(posture[None])))

    def batch(self, q: ArrayLike) -> H1ArmTerms:
        """Return the terms at postures ``q (n, 4)`` in rad, stacked; UsageError otherwise."""
        postures = _shaped(q, (-1, 4))
        n, nv = len(postures), self._model.nv
        position, jacobian = np.empty((n, 3)), np.empty((n, 3, nv))
        inertia, bias = np.empty((n, nv, nv)), np.empty((n, nv))
        for i, posture in enumerate(postures):
            self._place(posture)
            position[i] = self._data.site_xpos[self._site]
            mujoco.mj_jacSite(self._model, self._data, jacobian[i], None, self._site)
            mujoco.mj_fullM(self._model, self._data, inertia[i])
            # At rest the bias force is gravity alone.
            mujoco.mj_rne(self._model, self._data, 0, bias[i])
        # Contiguous, so that products round alike for one posture and for many.
        J = np.ascontiguousarray(jacobian[..., self._dof])
        M = np.ascontiguousarray(inertia[:, self._dof[:, None], self._dof])
        return H1ArmTerms(position, J, M, _task_inertia(J, M), bias[:, self._dof])

    def _place(self, posture: np.ndarray) -> None:
        """Bring everything that depends on the posture alone up to date; velocities stay 0."""
        self._data.qpos[self._qpos] = posture
        mujoco.mj_kinematics(self._model, self._data)
        # Only the parts of mj_forward that posture, inertia and gravity need.
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_crb(self._model, self._data)


def _task_inertia(J: np.ndarray, M: np.ndarray) -> np.ndarray:
    """Return the damped inverses of ``J M^-1 J^T``, ``(n, 3, 3)``."""
    mobility = J @ np.linalg.solve(M, J.swapaxes(1, 2))
    # Symmetric up to rounding; made exactly symmetric, as `eigh` reads only one triangle.
    s, V = np.linalg.eigh((mobility + mobility.swapaxes(1, 2)) / 2)
    # Largest first, as from a singular value decomposition, which takes three times as long.
    s, V = s[:, ::-1], np.ascontiguousarray(V[..., ::-1])
    # Forces stay bounded where the arm is stretched and has almost no mobility in a direction.
    damped = s / (s**2 + (TASK_DAMPING * s[:, :1]) ** 2)
    inverses: np.ndarray = (V * damped[:, None, :]) @ V.swapaxes(1, 2)
    return inverses


def _shaped(q: ArrayLike, shape: tuple[int, int] | tuple[int]) -> np.ndarray:
    array = np.asarray(q, dtype=float)
    if array.ndim != len(shape) or array.shape[-1] != 4:
        wanted = "(4,)" if len(shape) == 1 else "(n, 4)"
        raise UsageError(f"q: its shape is {array.shape}; the right arm's postures are {wanted}")
    return array
