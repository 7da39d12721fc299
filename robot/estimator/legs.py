"""Kinematics of the legs: the soles' points, how joints move them, and the forces on the feet.

The legs are a copy of the H1's model without its torso and floor, its pelvis fixed at the origin,
so everything is in the pelvis' frame. Each leg has five joints; the first ten of
``description.JOINTS`` are the joints of both legs.
"""

from typing import NamedTuple

import numpy as np

from spikeport.robot.description import JOINTS, MODEL_PATH
from spikeport.robot.engine import mujoco
from spikeport.robot.feet import POINTS

LEG_JOINTS = 10
WAIST = JOINTS.index("torso")
_LEG = LEG_JOINTS // 2
DAMPING = 1e-4 * np.eye(3)
"""Added to J J^T, in m^2: a straight leg has no lever along itself."""


class Soles(NamedTuple):
    """Contact shapes' centres in the pelvis' frame.

    Attributes
    ----------
    points : ndarray, (4, 3)
        Centres of the shapes of `POINTS`, m.
    jacobians : ndarray, (4, 3, 10)
        Derivatives of the points with respect to the legs' joints, m/rad.
    turning : ndarray, (4, 3, 10)
        Derivatives of the feet's rotation, likewise: angular velocity = turning dq.
    """

    points: np.ndarray
    jacobians: np.ndarray
    turning: np.ndarray


class Legs:
    """The legs by themselves.

    Attributes
    ----------
    radii_m : ndarray, (4,)
        The radii of the contact shapes.
    """

    def __init__(self) -> None:
        spec = mujoco.MjSpec.from_file(str(MODEL_PATH))
        whole = spec.compile()
        shapes = [whole.geom(name) for name in POINTS]
        self.radii_m = np.array([shape.size[0] for shape in shapes])
        self._places = np.array([shape.pos for shape in shapes])
        bodies = [whole.body(int(shape.bodyid[0])).name for shape in shapes]
        self._model = _without_torso(spec)
        self._data = mujoco.MjData(self._model)
        self._bodies = [self._model.body(name).id for name in bodies]

    def soles(self, q: np.ndarray) -> Soles:
        """Return the soles at joint angles (10 or more,), the legs' first."""
        model, data = self._model, self._data
        data.qpos[:] = q[:LEG_JOINTS]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        points = np.empty((len(POINTS), 3))
        jacobians, turning = np.zeros((2, len(POINTS), 3, LEG_JOINTS))
        for i, body in enumerate(self._bodies):
            points[i] = data.xpos[body] + data.xmat[body].reshape(3, 3) @ self._places[i]
            mujoco.mj_jac(model, data, jacobians[i], turning[i], points[i], body)
        return Soles(points, jacobians, turning)


def support_n(soles: Soles, torque: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return (2,) the upward forces in N on both feet, from the torques (10 or more,) of the legs.

    tau = -J^T f, solved for the force f at the middle of the foot, f = -(J J^T + DAMPING)^-1 J tau.
    Weight and inertia of the legs are left out, so a swinging leg has an apparent force; ``up``
    (3,) is the world's vertical in the pelvis' frame.
    """
    middle = soles.jacobians.reshape(2, 2, 3, 2, _LEG).mean(axis=1)  # (foot, axis, leg, joint)
    # Only a foot's own leg moves it.
    own = middle[[0, 1], :, [0, 1]]
    pulled = own @ torque[:LEG_JOINTS].reshape(2, _LEG, 1)
    forces = np.linalg.solve(own @ own.transpose(0, 2, 1) + DAMPING, pulled)
    return np.asarray(-forces[:, :, 0] @ up)


def _without_torso(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a model's legs on a pelvis that is fixed to the world's origin."""
    others = spec.actuators, spec.equalities, spec.pairs, spec.sensors, spec.cameras, spec.geoms
    for elements in others:
        for element in list(elements):
            spec.delete(element)
    spec.delete(spec.body("torso_link"))
    spec.delete(spec.joint("base"))
    spec.body("pelvis").pos = np.zeros(3)
    return spec.compile()
