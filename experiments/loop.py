"""A plant in closed loop with a network: its ports, and the loop that joins their values.

    values of the network -> ports drive -> plant steps -> ports observe -> inputs of the network

A port is one way in which a network commands a plant and observes it: an arm, a pair of legs, a
wheel. A loop concatenates the values of its ports, steps plant and network in turn and in one
thread, and holds commands and observations between two steps of the plant. So a run depends on its
seeds alone. Any robot can be put in a loop, see ``docs/own-robot.md``.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from numbers import Integral, Real
from typing import Any, Generic, Protocol, TypeVar

import nengo
import numpy as np

from spikeport.constants import DT_S
from spikeport.errors import DivergedError, UsageError
from spikeport.node_functions import NO_INPUT, Skippable
from spikeport.reading.mismatch import shown

ROUNDING = 1e-6
"""The rounding error that a ratio of time steps may have."""

NUMBERS = "biuf"
"""NumPy's kinds of real numbers, with bools as 0 and 1."""

NOT_BEGUN = (
    "the loop has begun no run, so the controller would observe zeros and the ports keep an "
    "earlier run; cure: call begin() when the plant is where the run starts, before the first step"
)


class SteppedPlant(Protocol):
    """A robot that advances in steps of ``dt_s`` and holds its commands between them.

    A step has to advance ``time_s`` by ``dt_s``, except if the plant has an attribute
    ``has_own_clock`` that is true, as a robot whose time goes on by itself.
    """

    @property
    def dt_s(self) -> float:
        """Length of a step, in s."""

    @property
    def time_s(self) -> float:
        """Simulated time since the robot was reset, in s."""

    def step(self) -> None:
        """Advance by one step."""


T = TypeVar("T")
P = TypeVar("P", bound=SteppedPlant)


class Port(ABC):
    """One way in which a network commands a plant and observes it.

    Attributes
    ----------
    size_in : int
        The number of values it takes from the network.
    size_out : int
        The number of values it returns to the network.
    """

    size_in: int = 0
    size_out: int = 0

    def begin(self) -> None:  # noqa: B027, a port that keeps nothing has nothing to forget
        """Forget an earlier run; the plant is already where the new run begins."""

    @abstractmethod
    def observe(self) -> np.ndarray:
        """Return the network's observation, ``(size_out,)``, of the plant's present state.

        It is called when a run begins, and after every step of the plant.
        """

    @abstractmethod
    def drive(self, values: np.ndarray) -> None:
        """Command the plant for its next step with values of the network, ``(size_in,)``.

        Raises
        ------
        DivergedError
            If the plant cannot take a value.
        """

    @property
    def over(self) -> bool:
        """True once the run is to end early, for example because the robot fell."""
        return False


class Loop(Generic[P]):
    """A plant and its ports, stepped by the values of a controller.

    Parameters
    ----------
    plant : SteppedPlant
        The robot, already where a run begins.
    ports : sequence of Port
        Its ports. Their values lie one after the other, in this order.
    dt_s : float
        Time step of the controller and its simulator; the plant's is a multiple of it.
    gate : Port, optional
        A port that opens and closes other ports. It is served before them, so that it takes effect
        in the same step; its values come after theirs.

    Attributes
    ----------
    over : bool
        True if one of the ports is over.
    size_in, size_out : int
        The total numbers of values that the ports take and return.

    Raises
    ------
    UsageError
        If the plant's time step is no multiple of the controller's, if ``ports`` is no sequence of
        different ports with sizes, or if ``plant`` is no plant.
    """

    def __init__(
        self, plant: P, ports: Sequence[Port], dt_s: float = DT_S, gate: Port | None = None
    ) -> None:
        _check_plant(plant)
        gates, listed = [] if gate is None else [gate], _listed(ports)
        self.plant = plant
        self._ports = [*listed, *gates]
        self._ticks = _ratio(plant.dt_s, dt_s)
        _check_ports(self._ports)
        places = [*_placed(self._ports, [port.size_in for port in self._ports])]
        # The gate is served first, but its values come last.
        self._served = [*places[len(listed) :], *places[: len(listed)]]
        self._n_gates = len(gates)
        self._dt_s = dt_s
        self._tick, self._last_s = 0, -math.inf
        self._pace: _Pace | None = _Pace(dt_s)
        self._plant_clock = _PlantClock(plant)
        self._stepped = _Stepped(self)
        self.size_in = sum(port.size_in for port in self._ports)
        self.size_out = sum(port.size_out for port in self._ports)
        self._observation = np.zeros(self.size_out)
        self._is_begun = False
        self._is_connected = False
        self.over = False

    def begin(self) -> None:
        """Begin a run from the plant's present state.

        Raises
        ------
        UsageError
            If an observation does not have the shape that its port names.
        DivergedError
            If a value of an observation is not finite.
        """
        self._tick, self._last_s = 0, -math.inf
        self._pace = _Pace(self._dt_s)
        # A backend may still be holding an observation of the last run.
        self._stepped.end_skip()
        for port, _ in self._served:
            port.begin()
        self._plant_clock.begin()
        self._observe()
        self._is_begun = True

    def step(self, values: np.ndarray) -> np.ndarray:
        """Advance by a step of the controller.

        The plant steps in the last of the controller's steps that make one of its own.

        Parameters
        ----------
        values : (size_in,) array
            The values of the controller, port by port.

        Returns
        -------
        ndarray, (size_out,)
            The last observation, port by port.

        Raises
        ------
        UsageError, DivergedError
            As `begin`, or if no run was begun; if a step of the plant gets another number of
            values, or none that are real numbers; also if the plant's own time does not advance by
            its ``dt_s``, or goes back.
        """
        if not self._is_begun:
            raise UsageError(NOT_BEGUN)
        self._tick += 1
        if self._tick % self._ticks == 0:
            self._advance(_commands(values, self.size_in))
        return self._observation

    def step_at(self, time_s: float, values: np.ndarray) -> np.ndarray:
        """Advance as `step` does, and check the time of the simulator that makes the step.

        Raises
        ------
        UsageError
            If the simulator's time step is not ``dt_s``, or its time does not rise within a run;
            also as `step`.
        DivergedError
            As `step`.
        """
        if not self._is_begun:
            raise UsageError(
                f"{NOT_BEGUN}, and reset() the simulator, whose step was broken off; code "
                "that makes a network for a command calls begin() itself"
            )
        if time_s <= self._last_s:
            raise UsageError(
                f"the simulator's time went from {self._last_s:g} s to {time_s:g} s within a run: "
                "it was reset, or another simulator steps the plant, too; cure: call begin() after "
                "reset(), or make a network and a Loop for each simulator"
            )
        self._last_s = time_s
        if self._pace is not None and self._pace.is_kept(time_s, self._tick):
            self._pace = None
        return self.step(values)

    def skip(self) -> int:
        """Skip the controller's steps before the plant's next step, and return their number."""
        skipped = self._ticks - 1 - self._tick % self._ticks
        self._tick += skipped
        return skipped

    def _advance(self, values: np.ndarray) -> None:
        for port, place in self._served:
            port.drive(values[place])
        self.plant.step()
        self._plant_clock.check()
        self._observe()

    def _observe(self) -> None:
        found = [port.observe() for port, _ in self._served]
        observed = found[self._n_gates :] + found[: self._n_gates]
        observation = _joined(observed, self.size_out)
        if observation is None:
            # There may be no fault: squares of large numbers overflow, and a list is no array.
            time_s = self.plant.time_s
            observation = np.concatenate(
                [_checked(*one, time_s) for one in zip(self._ports, observed, strict=True)]
            )
        self._observation = observation
        self.over = any(port.over for port in self._ports)

    def connect(self, inputs: Sequence[nengo.Node], outputs: Sequence[nengo.Node]) -> nengo.Node:
        """Connect a controller of the current network with the plant, without synapses.

        Parameters
        ----------
        inputs : sequence of nengo.Node
            The controller's inputs; concatenated, they take the observations of all ports.
        outputs : sequence of nengo.Node
            The controller's outputs; concatenated, they are the values of all ports.

        Returns
        -------
        nengo.Node
            The node of the plant.

        Raises
        ------
        UsageError
            If the ports have more or fewer values, or the loop is already connected.
        """
        if self._is_connected:
            raise UsageError(
                "the loop is connected already, and a second controller would step its plant, too; "
                "cure: name all inputs and outputs in one connect(), or make another Loop"
            )
        _check_size("inputs take", inputs, sum(node.size_in for node in inputs), self.size_out)
        _check_size("outputs are", outputs, sum(node.size_out for node in outputs), self.size_in)
        plant = nengo.Node(
            self._stepped,
            size_in=self.size_in,
            size_out=self.size_out,
            label="plant",
        )
        for node, place in _placed(inputs, [node.size_in for node in inputs]):
            # No synapse: observations arrive unfiltered; the delay of a step is the plant's own.
            nengo.Connection(plant[place], node, synapse=None)
        for node, place in _placed(outputs, [node.size_out for node in outputs]):
            nengo.Connection(node, plant[place], synapse=None)
        self._is_connected = True
        return plant


class _Stepped(Skippable):
    """The function of a plant's node: called in the plant's steps, it holds its value in others."""

    def __init__(self, loop: Loop[Any]) -> None:
        self._loop = loop

    def __call__(self, t: float, values: np.ndarray = NO_INPUT) -> np.ndarray:
        return self._loop.step_at(t, values)

    def skip(self) -> int:
        return self._loop.skip()


class _Pace:
    """Comparison of a simulator's time step with a loop's, by the first two calls of a run.

    It takes two calls, since a run may begin at any time of the simulator. Steps between the calls
    may have been skipped.
    """

    def __init__(self, dt_s: float) -> None:
        self._dt_s = dt_s
        self._first: tuple[float, int] | None = None

    def is_kept(self, time_s: float, tick: int) -> bool:
        """Return whether steps take ``dt_s``; False as long as this is not known yet.

        Raises
        ------
        UsageError
            If steps take another time.
        """
        if self._first is None:
            self._first = time_s, tick
            return False
        found_s = (time_s - self._first[0]) / (tick - self._first[1])
        if abs(found_s - self._dt_s) > ROUNDING * self._dt_s:
            raise UsageError(
                f"the loop is made for time steps of {1000 * self._dt_s:g} ms, the simulator's are "
                f"{1000 * found_s:g} ms, so the plant would run at another speed; cure: "
                f"Loop(..., dt_s={found_s:g}), or a simulator with dt={self._dt_s:g}"
            )
        return True


class _PlantClock:
    """A check that a plant's time advances as its ``dt_s`` says."""

    def __init__(self, plant: SteppedPlant) -> None:
        self._plant = plant
        self._dt_s = plant.dt_s
        self._is_known = False
        self._last_s = -math.inf

    def begin(self) -> None:
        """Begin a run at the plant's present time."""
        self._last_s = self._plant.time_s
        # A robot at the end of a link may be held, or miss a step.
        self._is_known = getattr(self._plant, "has_own_clock", False)

    def check(self) -> None:
        """Check the time after a step; its length is compared in the first step of a run alone.

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
        if not self._is_known:
            self._check_length(found_s)
            self._is_known = True

    def _check_length(self, found_s: float) -> None:
        if abs(found_s - self._dt_s) > ROUNDING * self._dt_s:
            raise UsageError(
                f"a step of the plant took {1000 * found_s:g} ms by its time_s, but its dt_s was "
                f"{1000 * self._dt_s:g} ms when the loop was made; cure: let both agree, with all "
                "of MuJoCo's steps in a step"
            )


def _check_plant(plant: object) -> None:
    missing = [name for name in ("dt_s", "time_s", "step") if not hasattr(plant, name)]
    if missing:
        raise UsageError(
            f"Loop(plant, ports): {type(plant).__name__} has no {' and no '.join(missing)}; cure: "
            "a plant as SteppedPlant describes it"
        )
    for name in ("dt_s", "time_s"):
        _check_no_method(plant, name, "a number, in s")


def _check_no_method(owner: object, name: str, expected: str) -> None:
    """Refuse a method in place of a value: it would count as true, and as no number."""
    if callable(getattr(type(owner), name, None)):
        raise UsageError(
            f"Loop(plant, ports): {type(owner).__name__}.{name} is a method, expected {expected}; "
            "cure: write @property above it"
        )


def _listed(ports: object) -> list[Port]:
    """Return ports as a list; refuse a single port, and a mapping, which has no order of values."""
    if not isinstance(ports, Iterable) or isinstance(ports, Mapping):
        raise UsageError(
            f"Loop(plant, ports): ports is one {type(ports).__name__}, expected a sequence of "
            "ports; cure: Loop(plant, [port])"
        )
    return [*ports]


def _check_ports(ports: Sequence[Port]) -> None:
    if not ports:
        raise UsageError("Loop(plant, ports): no port, at least 1; cure: Loop(plant, [port])")
    for number, port in enumerate(ports):
        if not isinstance(port, Port):
            raise UsageError(
                f"Loop(plant, ports): {shown(port)} is no port; cure: an object of a subclass of "
                "spikeport.experiments.loop.Port"
            )
        if any(port is other for other in ports[:number]):
            raise UsageError(
                f"Loop(plant, ports): a {type(port).__name__} is listed twice; cure: an object for "
                "each place"
            )
        _check_no_method(port, "over", "True or False")
        for name, use in (("size_in", "drive() takes"), ("size_out", "observe() returns")):
            size = getattr(port, name)
            if not isinstance(size, Integral) or size < 0:
                raise UsageError(
                    f"{type(port).__name__}.{name} is {shown(size)}, limit whole numbers from 0 "
                    f"on; cure: the number of values that {use}"
                )


def _commands(values: Any, size: int) -> np.ndarray:
    """Return a copy of a controller's values (size,), of which ports may keep parts."""
    found = _array(values)
    if found is None or found.dtype.kind not in NUMBERS or found.shape != (size,):
        raise UsageError(
            f"Loop.step() got {_named(values)} where an array of shape ({size},) is expected, the "
            "sum of all size_in; cure: pass the values of all ports, one after the other"
        )
    return found.astype(float)


def _joined(observed: Sequence[np.ndarray], size: int) -> np.ndarray | None:
    """Return the concatenated observations; None if one of them seems to be wrong."""
    # A masked array is refused, too: NumPy would read its masked values as numbers.
    if any(type(one) is not np.ndarray for one in observed):
        return None
    try:
        # This casting refuses complex numbers, whose imaginary parts would be dropped later.
        joined = np.concatenate(observed, dtype=float, casting="same_kind")
        # NaN and infinity survive in a sum of squares, which is three times as fast as isfinite.
        sound = joined.shape == (size,) and math.isfinite(joined.dot(joined))
    except (TypeError, ValueError):
        return None
    return joined if sound else None


def _checked(port: Port, value: Any, time_s: float) -> np.ndarray:
    """Return an observation as an array (size_out,); refuse all but finite real numbers."""
    returned, size = f"{type(port).__name__}.observe() returned", port.size_out
    found = _array(value)
    kind = "" if found is None else found.dtype.kind
    if kind == "c":  # NumPy would drop the imaginary parts
        raise UsageError(
            f"{returned} complex numbers at {time_s:g} s, limit real ones; cure: return real and "
            "imaginary parts as values of their own"
        )
    # NumPy would convert None, times and texts to numbers, too.
    if found is None or kind not in NUMBERS or found.shape != (size,):
        raise UsageError(
            f"{returned} {_named(value)} at {time_s:g} s, expected an array of shape ({size},), as "
            "its size_out says; cure: return a flat array of that many numbers, or change size_out"
        )
    finite = np.isfinite(found)
    if not finite.all():
        worst = int(np.argmin(finite))
        raise DivergedError(
            f"{returned} {found[worst]} as value {worst} of 0 to {size - 1} at {time_s:g} s, "
            "limit finite numbers; cure: return a finite one, or look at the plant's state"
        )
    return found.astype(float)


def _array(value: object) -> np.ndarray | None:
    """Return a value as an array; None if it cannot be one, or is masked."""
    if isinstance(value, np.ma.MaskedArray):
        return None
    try:
        return np.asarray(value)
    except ValueError:  # lists of different lengths
        return None


def _named(value: object) -> str:
    """Return a wrong value in words: the shape of an array of numbers, or else the value."""
    if isinstance(value, np.ma.MaskedArray):
        return f"a masked array, {shown(value)},"
    found = _array(value)
    if found is not None and found.dtype.kind in NUMBERS:
        return f"an array of shape {found.shape}"
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype}, {shown(value)},"
    return shown(value)


def _ratio(plant_s: float, controller_s: float) -> int:
    """Return the number of the controller's steps in a step of the plant."""
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


def _check_size(what: str, nodes: Sequence[nengo.Node], found: int, size: int) -> None:
    if found != size:
        names = ", ".join(str(node) for node in nodes)
        raise UsageError(
            f"the controller's {what} {found} values ({names}), but the ports have {size}; "
            "cure: pass nodes with as many values as the ports, in their order"
        )


def _placed(owners: Sequence[T], sizes: Sequence[int]) -> Iterator[tuple[T, slice]]:
    """Yield ports or nodes, each with the slice of its values among all concatenated values."""
    ends = np.cumsum(sizes).tolist()
    return zip(owners, map(slice, [0, *ends], ends), strict=True)
