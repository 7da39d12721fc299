"""Ways to obey a path follower: as the paper's law commands, or turning first and standing still.

The paper's law commands a speed by distance alone, whatever the bearing. A robot whose reference
stands, or is behind it, then circles it at full speed, for ever. `TurnFirst` slows a robot down
that is to turn by more than `AHEAD_RAD`, to a turn in place from `ASIDE_RAD` on, and lets it stand
near a reference that stands. Within `AHEAD_RAD` commands are those of the law, to the last bit.
"""

import math

import numpy as np

TURN_FIRST, PAPER = "turn-first", "paper"
LAWS = (TURN_FIRST, PAPER)
AHEAD_RAD, ASIDE_RAD = 1.0, 1.6
NEAR_M, FAR_M = 0.2, 0.4
"""A robot that is nearer stands, until it is farther away."""
STANDS_M_S = 0.02
"""A reference that is slower stands."""


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
        # Two distances, so that a robot that sways does not set off and stop again and again.
        self._stands = bool(still and np.hypot(x, y) < (FAR_M if self._stands else NEAR_M))
        if self._stands:
            return np.zeros(2)
        turn = float(np.arctan2(y, x)) - heading_rad
        bearing = abs((turn + math.pi) % (2 * math.pi) - math.pi)
        if bearing <= AHEAD_RAD:
            return command
        # It fades between two bearings, for the speed not to jump.
        share = max(0.0, (ASIDE_RAD - bearing) / (ASIDE_RAD - AHEAD_RAD))
        return np.array((share * command[0], command[1]))
