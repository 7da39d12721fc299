"""The clocks of a loop: the time steps of its controller, simulator and plant, compared."""

import math
from numbers import Real
from typing import TYPE_CHECKING

from spikeport.errors import DivergedError, UsageError
from spikeport.reading.mismatch import shown

if TYPE_CHECKING:
    from spikeport.experiments.loop import SteppedPlant

ROUNDING = 1e-6
"""The rounding error that a ratio of time steps may have."""


def controller_steps(plant_s: float, controller_s: float) -> int:
    """Return the number of the controller's steps in a step of the plant.

    Raises
    ------
    UsageError
        If a time step is not above 0 and finite, or the plant's is no multiple of the controller's.
    """
    for whose, step_s in (("the plant's dt_s", plant_s), ("dt_s", controller_s)):
        if not isinstance(step_s, Real) or not 0 < step_s < math.inf:
            raise UsageError(
                f"{whose} is {shown(step_s)} s, limit above 0 and finite; cure: the length of a "
                "step in s"
            )
    ratio = plant_s / controller_s
    if round(ratio) < 1 or abs(ratio - round(ratio)) > ROUNDING * ratio:
        raise UsageError(
            f"the plant steps every {1000 * plant_s:g} ms, which is no multiple of the "
            f"controller's {1000 * controller_s:g} ms; cure: another time step of either, or "
            "several of MuJoCo's steps in a step of the plant"
        )
    return round(ratio)


class SimulatorClock:
    """A check that a simulator's time rises within a run, and by the time step of the loop.

    Parameters
    ----------
    dt_s : float
        The time step of the loop.
    """

    def __init__(self, dt_s: float) -> None:
        self._dt_s = dt_s
        self.begin()

    def begin(self) -> None:
        """Begin a run, at any time of the simulator."""
        self._last_s = -math.inf
        self._first: tuple[float, int] | None = None
        self._is_known = False

    def check(self, time_s: float, tick: int) -> None:
        """Check the time of a step; its length is compared in the second call of a run alone.

        Parameters
        ----------
        time_s : float
            The simulator's time.
        tick : int
            The number of the controller's steps before; some may have been skipped.

        Raises
        ------
        UsageError
            If time did not rise, or steps take another time than the loop's.
        """
        if time_s <= self._last_s:
            raise UsageError(
                f"the simulator's time went from {self._last_s:g} s to {time_s:g} s within a run: "
                "it was reset, or another simulator steps the plant, too; cure: call begin() after "
                "reset(), or make a network and a Loop for each simulator"
            )
        self._last_s = time_s
        if self._first is None:
            self._first = time_s, tick
        elif not self._is_known:
            first_s, first = self._first
            self._check_length((time_s - first_s) / (tick - first))
            self._is_known = True

    def _check_length(self, found_s: float) -> None:
        if abs(found_s - self._dt_s) > ROUNDING * self._dt_s:
            raise UsageError(
                f"the loop is made for time steps of {1000 * self._dt_s:g} ms, the simulator's are "
                f"{1000 * found_s:g} ms, so the plant would run at another speed; cure: "
                f"Loop(..., dt_s={found_s:g}), or a simulator with dt={self._dt_s:g}"
            )


class PlantClock:
    """A check that a plant's time advances as its ``dt_s`` says."""

    def __init__(self, plant: "SteppedPlant") -> None:
        self._plant = plant
        self._dt_s = plant.dt_s
        self._has_own_clock = False
        self._last_s = -math.inf

    def begin(self) -> None:
        """Begin a run at the plant's present time."""
        self._last_s = self._plant.time_s
        # A robot at the end of a link may be held, or miss a step.
        self._has_own_clock = getattr(self._plant, "has_own_clock", False)

    def check(self) -> None:
        """Check the time after a step.

        A reset in the first step of a run remains unnoticed: time goes from 0 to ``dt_s`` all the
        same.

        Raises
        ------
        UsageError
            If the step took another time than ``dt_s``.
        DivergedError
            If time went back.
        """
        before_s, self._last_s = self._last_s, self._plant.time_s
        found_s = self._last_s - before_s
        if found_s < 0:
            raise DivergedError(
                f"the plant's time went from {before_s:g} s to {self._last_s:g} s within a run: it "
                "was reset, as MuJoCo does if a simulation diverges; cure: a shorter time step or "
                "weaker commands, or begin() after a reset() of yours"
            )
        if not self._has_own_clock:
            self._check_length(found_s)

    def _check_length(self, found_s: float) -> None:
        if abs(found_s - self._dt_s) > ROUNDING * self._dt_s:
            raise UsageError(
                f"a step of the plant took {1000 * found_s:g} ms by its time_s, but its dt_s was "
                f"{1000 * self._dt_s:g} ms when the loop was made; cure: let both agree, with all "
                "of MuJoCo's steps in a step"
            )
