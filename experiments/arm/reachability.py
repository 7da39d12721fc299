"""A check before a run that points can be reached; its error names the nearest such point.

    q* = argmin_q |x(q) - p|^2,  q_low <= q <= q_high          nearest reachable point: x(q*)

solved by bounded least squares from the nearest of a grid of postures, for the few points that some
damped Newton steps of all points at once do not reach. A network is also limited to the region of
states it was made for.
"""

import functools
from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from spikeport.errors import UsageError
from spikeport.networks.region import ArmRegion
from spikeport.robot.arm import ArmDynamics

TOLERANCE_M = 0.001
"""The distance within which an arm counts as having reached its target."""
LIMIT_MARGIN_RAD = 0.02
"""Margin to every joint limit: a controller cannot hold a joint exactly at it."""
STARTS = 7
"""Angles of each joint in the grid of postures from which searches start."""
TRIED = 24
"""Postures of the grid tried for each point: the search from one may end at a joint limit."""
NEWTON_STEPS = 8
"""Steps for all points at once; most points within reach take two or three."""
DAMPING_M2 = 1e-4
"""Damping of these steps where the arm is stretched, in (m/rad)^2."""
MAX_STEPS = 100
"""The most steps of a search; a point within reach takes far fewer."""


def check_reachable(what: str, points: np.ndarray) -> None:
    """Raise `UsageError` if one of the points (n, 3) in m is out of the arm's reach.

    The message names ``what`` the points belong to, and the first point out of reach.
    """
    _check_reachable(what, np.ascontiguousarray(points, dtype=float).tobytes())


# Cached, since runs of a sweep have the same points.
@functools.lru_cache(maxsize=64)
def _check_reachable(what: str, content: bytes) -> None:
    points = np.frombuffer(content).reshape(-1, 3)
    _check("reach of the right arm", what, points, nearest_reachable(points))


def check_in_region(what: str, points: np.ndarray, region: ArmRegion) -> None:
    """Raise `UsageError` if a network is not made for one of the points (n, 3) in m."""
    _check("the region the network is made for", what, points, region.x.clip(points))


def _check(where: str, what: str, points: np.ndarray, inside: Iterable[np.ndarray]) -> None:
    for point, nearest in zip(points, inside, strict=True):
        gap_m = np.linalg.norm(point - nearest)
        if gap_m > TOLERANCE_M:
            raise UsageError(
                f"{what}: {_text(point)} is out of {where}, by {100 * gap_m:.1f} cm; the nearest "
                f"point inside is {_text(nearest)}; cure: move the goal there, or make it smaller"
            )


def _text(point: np.ndarray) -> str:
    return f"({', '.join(f'{value:.3f}' for value in point)}) m"


def nearest_reachable(points: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the point (3,) of the arm's workspace nearest to each point (n, 3), all in m."""
    arm = ArmDynamics()
    margin = np.array([LIMIT_MARGIN_RAD, -LIMIT_MARGIN_RAD])
    low, high = (arm.limits_rad + margin).T
    # Away from the limits, where a search would start with its derivative cut off.
    shares = np.linspace(0.05, 0.95, STARTS)
    postures = low + (high - low) * np.array(list(product(shares, repeat=4)))
    _, starts = cKDTree(arm.batch(postures).position).query(points, TRIED)
    stepped = _stepped(arm, points, postures[starts[:, 0]], (low, high))
    for point, near, place in zip(points, starts, stepped, strict=True):
        if np.linalg.norm(point - place) < TOLERANCE_M:
            yield place
        else:
            yield point + _least_gap(arm, point, postures[near], (low, high))


def _stepped(
    arm: ArmDynamics, points: np.ndarray, q: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return where steps of the postures ``q`` (n, 4) to points (n, 3) take the hand, (n, 3)."""
    for _ in range(NEWTON_STEPS):
        at = arm.batch(q)
        J_T = at.jacobian.swapaxes(1, 2)
        damped = at.jacobian @ J_T + DAMPING_M2 * np.eye(3)
        step = J_T @ np.linalg.solve(damped, (points - at.position)[..., np.newaxis])
        q = np.clip(q + step[..., 0], *bounds)
    return arm.batch(q).position


def _least_gap(
    arm: ArmDynamics, point: np.ndarray, starts: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the vector (3,) from a point to the nearest place of the hand, from several starts."""
    least = np.full(3, np.inf)
    for start in starts:
        gap = least_squares(
            lambda q: arm.at(q).position - point,
            start,
            jac=lambda q: arm.at(q).jacobian,
            bounds=bounds,
            max_nfev=MAX_STEPS,
        ).fun
        least = min(least, gap, key=np.linalg.norm)
        if np.linalg.norm(least) < TOLERANCE_M:
            break
    return least
