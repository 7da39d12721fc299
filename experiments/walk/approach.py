"""Ways to obey a path follower: as the paper's law commands, or turning first and standing still.

The paper's law commands a speed from distance and velocity, whatever the bearing. A robot whose
reference stands still, or is behind it, then circles the reference at full speed, for ever.
`TurnFirst` slows the robot if it has to turn by more than `AHEAD_RAD`; from `ASIDE_RAD` on, the
robot turns in place. Near a reference that stands still, the robot stands still, too. Within
`AHEAD_RAD`, commands are those of the law, to the last bit.
"""

import math

import numpy as np

TURN_FIRST, PAPER = "turn-first", "paper"
LAWS = (TURN_FIRST, PAPER)
AHEAD_RAD, ASIDE_RAD = 1.0, 1.6
NEAR_M, FAR_M = 0.2, 0.4
"""Within `NEAR_M` of a reference that stands, a robot stands until it is beyond `FAR_M`."""
STANDS_M_S = 0.02
"""A reference that is slower than this stands."""


class TurnFirst:
    """Commands of a robot that turns before it walks back, and stands where it is to stand."""

    def __init__(self) -> None:
        self._stands = False

    def begin(self) -> None:
        """Forget an earlier run."""
        self._stands = False

    def limited(self, command: np.ndarray, reference: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Return forward speed in m/s and yaw rate in rad/s, (2,).

        Parameters
        ----------
        command : (2,) array
            The speed and yaw rate that the follower commands.
        reference : (4,) array
            Place in m and velocity in m/s to take.
        state : (5,) array
            Heading in rad, place and velocity of the robot.
        """
        # Plain numbers, which are faster than arrays of a few.
        to_x, to_y, vx, vy = reference.tolist()
        heading_rad, at_x, at_y = state[:3].tolist()
        x, y = to_x - at_x, to_y - at_y
        still = np.hypot(vx, vy) < STANDS_M_S
        # With two distances, a swaying robot does not set off and stop again and again.
        self._stands = bool(still and np.hypot(x, y) < (FAR_M if self._stands else NEAR_M))
        if self._stands:
            return np.zeros(2)
        turn = float(np.arctan2(y, x)) - heading_rad
        bearing = abs((turn + math.pi) % (2 * math.pi) - math.pi)
        if bearing <= AHEAD_RAD:
            return command
        # The speed fades between the two bearings, so that it does not jump.
        share = max(0.0, (ASIDE_RAD - bearing) / (ASIDE_RAD - AHEAD_RAD))
        return np.array((share * command[0], command[1]))
