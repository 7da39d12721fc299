"""Clocks of every foot: its time in the air or on the floor, and since it was last lifted."""

import numpy as np

from spikeport.arrays import Flags
from spikeport.robot.walk_interface import CONTROL_DT_S


class Gait:
    """The gait of n robots, left foot first; all times in s, ``(n, 2)``.

    Attributes
    ----------
    contact : ndarray of bool
        True if the foot is on the floor.
    air_s, contact_s : ndarray
        Time in the air and on the floor; one of them is 0.
    since_lift_s : ndarray
        Time since the foot last left the floor.
    touched_down : ndarray of bool
        True if the foot came down in the last step.
    last_air_s : ndarray
        The time in the air before the foot last came down.
    lifted : ndarray of bool
        True if the foot left the floor in the last step.
    both_s : ndarray, (n,)
        Time for which both feet have been on the floor, or had been before the last step.
    """

    def __init__(self, n: int) -> None:
        self.air_s, self.contact_s, self.since_lift_s = np.zeros((3, n, 2))
        self.last_air_s = np.zeros((n, 2))
        self.contact = np.ones((n, 2), bool)
        self.touched_down, self.lifted = np.zeros((2, n, 2), bool)
        self.both_s = np.zeros(n)
        self._landed = np.zeros((n, 2), bool)

    def reset(self, which: Flags) -> None:
        """Start anew; a foot counts as on the floor until it first touches it."""
        for clock in (self.air_s, self.contact_s, self.since_lift_s, self.last_air_s):
            clock[which] = 0.0
        self.contact[which] = True
        self.touched_down[which], self.lifted[which] = False, False
        self.both_s[which] = 0.0
        self._landed[which] = False

    def update(self, contact: Flags) -> None:
        """Advance by one control step with the feet on the floor or not, ``(n, 2)``."""
        self._landed |= contact
        contact = contact | ~self._landed
        self.touched_down = contact & ~self.contact
        self.last_air_s = np.where(self.touched_down, self.air_s, self.last_air_s)
        self.lifted = ~contact & self.contact
        self.since_lift_s = np.where(self.lifted, 0.0, self.since_lift_s + CONTROL_DT_S)
        self.air_s = np.where(contact, 0.0, self.air_s + CONTROL_DT_S)
        self.contact_s = np.where(contact, self.contact_s + CONTROL_DT_S, 0.0)
        both_before = self.contact.all(axis=1)
        self.both_s = np.where(
            contact.all(axis=1), self.both_s + CONTROL_DT_S, np.where(both_before, self.both_s, 0.0)
        )
        self.contact = contact
