"""A check whether a simulation has diverged, which names the first quantity out of bounds."""

from typing import NamedTuple

import numpy as np

from spikeport.compiled import compiled, make_ready
from spikeport.errors import DivergedError
from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco

STOP_MARGIN_RAD = 0.5
"""The margin of a joint angle beyond its range: MuJoCo's joint stops are springs, and the knee's
yield by 0.44 rad when the knee hits them under full torque."""


class _Bound(NamedTuple):
    quantity: str
    low: float
    high: float
    unit: str


class Watch:
    """Bounds on every element of a plant's state.

    Base position 1 km, base velocity 50 m/s and 50 rad/s, joint angle: its range and
    `STOP_MARGIN_RAD` to either side, joint velocity 150 rad/s. A robot that walks, falls or drives
    its joints against their stops at full torque stays well within these bounds.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        ranges_rad = model.jnt_range[1:]
        self._bounds = [
            *(_Bound(f"base position {a}", -1e3, 1e3, "m") for a in "xyz"),
            *(_Bound(f"base quaternion {a}", -1.1, 1.1, "") for a in "wxyz"),
            *(
                _Bound(f"angle of {j}", low - STOP_MARGIN_RAD, high + STOP_MARGIN_RAD, "rad")
                for j, (low, high) in zip(JOINTS, ranges_rad, strict=True)
            ),
            *(_Bound(f"base velocity {a}", -50.0, 50.0, "m/s") for a in "xyz"),
            *(_Bound(f"base turn rate {a}", -50.0, 50.0, "rad/s") for a in "xyz"),
            *(_Bound(f"velocity of {j}", -150.0, 150.0, "rad/s") for j in JOINTS),
        ]
        self._low = np.array([b.low for b in self._bounds])
        self._high = np.array([b.high for b in self._bounds])
        self._first_outside = make_ready(_first_outside, self._low, self._low, self._high)

    def check(self, state: np.ndarray, time_s: float) -> None:
        """Raise `DivergedError` naming the first quantity that is out of bounds or not a number.

        Parameters
        ----------
        state : (nq + nv,) array
            Positions and velocities, as MuJoCo's ``qpos`` and ``qvel``.
        time_s : float
            The time of the state, in s.
        """
        if outside := self.outside(state):
            raise DivergedError(
                f"the simulation diverged at {time_s:.3f} s: {outside}; command smaller torques or "
                "gains (Plant.history() holds the last states)"
            )

    def outside(self, state: np.ndarray) -> str:
        """Return the first quantity that is out of bounds or not a number; empty if none is."""
        worst = self._first_outside(self._low, state, self._high)
        if worst == len(state):
            return ""
        bound, value = self._bounds[worst], float(state[worst])
        allowed = f"allowed {bound.low:.4g} to {bound.high:.4g} {bound.unit}".rstrip()
        return f"{bound.quantity} is {value:.4g}, {allowed}"


@compiled
def _first_outside(low: np.ndarray, values: np.ndarray, high: np.ndarray) -> int:
    """Return the index of the first value out of bounds or NaN; ``len(values)`` if none is."""
    for i in range(len(values)):
        if not (low[i] <= values[i] <= high[i]):
            return i
    return len(values)
