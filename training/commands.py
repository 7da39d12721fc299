"""Commands to the robot: speeds that change every few seconds, no faster than it can follow."""

from dataclasses import dataclass

import numpy as np

from spikeport.angles import wrap
from spikeport.arrays import Flags, Floats
from spikeport.robot.walk_interface import COMMAND_CHANGE_PER_S, CONTROL_DT_S


@dataclass(frozen=True)
class CommandRange:
    """The ranges that commands are drawn from.

    ``standing`` and ``turning`` are the shares of commands that ask to stand, and to turn in
    place; ``heading`` is the share of the others that ask for a direction, by the command
    wz = ``heading_gain`` * (direction - heading), limited to +- ``wz_rad_s``. Commands change no
    faster than `COMMAND_CHANGE_PER_S`, except for the share ``jumping``, which change at once. A
    robot whose command is at most ``still`` need not step.
    """

    vx_m_s: tuple[float, float] = (0.0, 1.0)
    wz_rad_s: float = 1.0
    standing: float = 0.0
    turning: float = 0.0
    heading: float = 0.5
    heading_gain: float = 1.0
    jumping: float = 0.0
    still: float = 0.1
    seconds: tuple[float, float] = (3.0, 8.0)


class Commands:
    """The commands of n robots, each with its own moments of change.

    Attributes
    ----------
    wanted : ndarray, (n, 3)
        The commands drawn: vx, vy (m/s) and wz (rad/s); vy is 0.
    value : ndarray, (n, 3)
        The commands that robots observe, which move from standing towards ``wanted``.
    age_s : ndarray, (n,)
        Time since the last draw.
    moving_s : ndarray, (n,)
        Time for which robots have been asked to move, 0 for those that are to stand.
    """

    def __init__(self, n: int, ranges: CommandRange, rng: np.random.Generator) -> None:
        self._ranges, self._rng = ranges, rng
        self.wanted, self.value = np.zeros((2, n, 3))
        self.age_s, self.moving_s, self._left_s = np.zeros((3, n))
        self._follows_heading, self._jumps = np.zeros((2, n), bool)
        self._direction_rad = np.zeros(n)
        self.draw(np.ones(n, bool))

    @property
    def moving(self) -> Flags:
        """The robots that are asked to move by now, ``(n,)``."""
        moving: Flags = np.abs(self.value).max(axis=1) > self._ranges.still
        return moving

    def restart(self, which: Flags) -> None:
        """Draw new commands for some robots that stand."""
        self.draw(which)
        self.value[which], self.moving_s[which] = 0.0, 0.0

    def draw(self, which: Flags) -> None:
        """Draw new commands for some robots, ``which (n,)`` of bool."""
        k, r, rng = np.count_nonzero(which), self._ranges, self._rng
        vx, wz = rng.uniform(*r.vx_m_s, k), rng.uniform(-r.wz_rad_s, r.wz_rad_s, k)
        kind = rng.random(k)
        # From both ends of one draw, so that no robot does both.
        stands, turns = kind < r.standing, kind > 1 - r.turning
        vx[stands | turns] = 0.0
        wz[stands] = 0.0
        self.wanted[which] = np.stack((vx, np.zeros(k), wz), axis=1)
        self._follows_heading[which] = (rng.random(k) < r.heading) & ~stands & ~turns
        self._direction_rad[which] = rng.uniform(-np.pi, np.pi, k)
        self._jumps[which] = rng.random(k) < r.jumping
        self._left_s[which] = rng.uniform(*r.seconds, k)
        self.age_s[which] = 0.0

    def update(self, heading_rad: Floats) -> None:
        """Advance by one control step, with the robots' headings ``(n,)``."""
        self._left_s -= CONTROL_DT_S
        self.age_s += CONTROL_DT_S
        self.draw(self._left_s <= 0)
        r, turning = self._ranges, self._follows_heading
        # The error along the shorter way round.
        error = wrap(self._direction_rad - heading_rad)
        wz = np.clip(r.heading_gain * error, -r.wz_rad_s, r.wz_rad_s)
        self.wanted[turning, 2] = wz[turning]
        per_s = np.where(self._jumps[:, None], np.inf, COMMAND_CHANGE_PER_S)
        most = CONTROL_DT_S * per_s
        self.value += np.clip(self.wanted - self.value, -most, most)
        self.moving_s = np.where(self.moving, self.moving_s + CONTROL_DT_S, 0.0)
