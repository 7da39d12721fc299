"""Arms that the policy does not move: a standing robot must balance whatever one arm does.

While a robot stands, one of its arms may wander between random poses instead of obeying the policy.
When the robot is asked to walk again, the arm first returns to its default pose.
"""

import numpy as np

from spikeport.robot import mirror
from spikeport.robot.description import ARM_JOINTS, JOINTS
from spikeport.robot.walk_interface import ACTION_SIZE, CONTROL_DT_S, POSE_RAD

LOWEST_RAD = np.array([-1.2, -0.6, -0.6, -0.4])
HIGHEST_RAD = np.array([0.3, 0.1, 0.6, 0.8])
"""Range of the right arm's poses, relative to its default pose."""
SPEED_RAD_S = 1.5
POSE_S = 1.5
"""Mean time from one pose to the next."""

_RIGHT = [JOINTS.index(joint) for joint in ARM_JOINTS]


class BusyArms:
    """The arms of n robots, of which a ``share`` has a busy one, left or right.

    Parameters
    ----------
    n : int
        Number of robots.
    share : float
        Probability that an arm is busy in an episode.
    rng : Generator
        Draws the robots, the sides and the poses.
    """

    def __init__(self, n: int, share: float, rng: np.random.Generator) -> None:
        self._share, self._rng = share, rng
        self._busy, self._left = np.zeros((2, n), bool)
        self._goal, self._offset = np.zeros((2, n, ACTION_SIZE))

    def restart(self, which: np.ndarray) -> None:
        """Draw which arms are busy, for some robots, ``which (n,)`` of bool."""
        k = np.count_nonzero(which)
        self._busy[which] = self._rng.random(k) < self._share
        self._left[which] = self._rng.random(k) < 0.5
        self._goal[which], self._offset[which] = 0.0, 0.0

    def override(self, targets: np.ndarray, standing: np.ndarray) -> np.ndarray:
        """Return joint targets ``(n, 19)``, rad: the policy's, except for busy arms.

        ``standing (n,)`` is True for robots that are asked to stand.
        """
        if not self._busy.any():
            return targets
        works = self._busy & standing
        self._goal[~works] = 0.0
        moves = works & (self._rng.random(len(works)) < CONTROL_DT_S / POSE_S)
        self._goal[moves] = self._draw(self._left[moves])
        most = CONTROL_DT_S * SPEED_RAD_S
        self._offset += np.clip(self._goal - self._offset, -most, most)
        taken = self._offset != 0.0
        return np.where(taken, POSE_RAD + self._offset, targets)

    def _draw(self, left: np.ndarray) -> np.ndarray:
        poses = np.zeros((len(left), ACTION_SIZE))
        poses[:, _RIGHT] = self._rng.uniform(LOWEST_RAD, HIGHEST_RAD, (len(left), len(_RIGHT)))
        return np.where(left[:, None], mirror.JOINT(poses), poses)
