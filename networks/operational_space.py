"""The arm's exact control law, which the spiking networks decode piece by piece.

    u = sum_d kp e_d f_d(q) - kv M(q) dq + g(q) + N(q)^T M(q) kn (q0 - q)

with e = x_target - x_hand, f_d the d-th column of J^T M_x, M_x the damped task-space inertia, g the
torque that holds the arm against gravity, and N^T = I - J^T M_x J M^-1 the projector onto torques
that do not accelerate the hand. Each term depends on q alone, or is a sum of terms in q
and one scalar (e_d, or the velocity dq_j of a joint), so ensembles of few dimensions can share the
work.

Source: paper, sec. 3.1 (u_kin, u_dyn, u_g; its -g is the force of gravity, g here the torque
against it). The posture term is ours: with three task dimensions and four joints, neurons would
let the elbow drift to a joint limit without it. The gains are ours too: the paper gives none.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from spikeport.arrays import Floats


class ArmTerms(Protocol):
    """Arm kinematics and dynamics at n poses; the first axis of every array is the pose."""

    @property
    def position(self) -> Floats: ...  # noqa: D102
    @property
    def jacobian(self) -> Floats: ...  # noqa: D102
    @property
    def inertia(self) -> Floats: ...  # noqa: D102
    @property
    def task_inertia(self) -> Floats: ...  # noqa: D102
    @property
    def gravity(self) -> Floats: ...  # noqa: D102


class Arm(Protocol):
    """An arm that computes the terms of the law at many poses."""

    def batch(self, q: Floats) -> ArmTerms:
        """Return the terms at q of shape (n, 4), in radians."""


@dataclass(frozen=True)
class Gains:
    """Gains of the law: kp in 1/s^2, kv in 1/s, kn in 1/s^2, rest posture q0 in radians."""

    kp: float = 100.0
    kv: float = 16.0
    kn: float = 25.0
    rest_rad: tuple[float, ...] = (-0.30, -0.10, 0.0, -0.15)


class LawTerms(NamedTuple):
    """The law's dependence on posture, at n poses."""

    kinematic: Floats
    """(n, 3, 4) kp f_d(q): torque in N m per metre of error along each axis."""
    damping: Floats
    """(n, 4, 4) -kv M(q): torque in N m per rad/s of each joint."""
    bias: Floats
    """(n, 4) g(q) plus the posture term, in N m."""


class OperationalSpaceLaw:
    """The law for one arm."""

    def __init__(self, arm: Arm, gains: Gains | None = None) -> None:
        self.arm = arm
        self.gains = gains or Gains()

    def terms(self, q: Floats) -> LawTerms:
        """Return the law's terms at q of shape (n, 4)."""
        arm, gains = self.arm.batch(q), self.gains
        force = np.swapaxes(arm.jacobian, 1, 2) @ arm.task_inertia  # (n, 4, 3) J^T M_x
        pull = arm.inertia @ (gains.kn * (np.asarray(gains.rest_rad) - q))[..., np.newaxis]
        # The part of the posture's pull that would move the hand. It is subtracted, so that the
        # hand feels nothing.
        felt = force @ arm.jacobian @ np.linalg.solve(arm.inertia, pull)
        return LawTerms(
            kinematic=gains.kp * np.swapaxes(force, 1, 2),
            damping=-gains.kv * arm.inertia,
            bias=arm.gravity + (pull - felt)[..., 0],
        )

    def torque(self, q: Floats, dq: Floats, error: Floats) -> Floats:
        """Return the exact torque (4,) in N m at a state; error (3,) in metres."""
        torque: Floats = self.torques(q[np.newaxis], dq[np.newaxis], error[np.newaxis])[0]
        return torque

    def torques(self, q: Floats, dq: Floats, error: Floats) -> Floats:
        """Return the exact torques (n, 4) in N m at n states; q, dq (n, 4) and error (n, 3)."""
        terms = self.terms(q)
        kinematic: Floats = np.einsum("nd,ndj->nj", error, terms.kinematic)
        damping: Floats = np.einsum("ni,nij->nj", dq, terms.damping)
        return kinematic + damping + terms.bias
