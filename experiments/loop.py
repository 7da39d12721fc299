"""A plant in closed loop with a network: its ports, and the loop that joins their values.

    values of the network -> ports drive -> plant steps -> ports observe -> inputs of the network

A port is one way in which a network commands a plant and observes it: an arm, a pair of legs, a
wheel. A loop concatenates the values of its ports, steps plant and network in turn and in one
thread, and holds commands and observations between two steps of the plant. So a run depends on its
seeds alone. Any robot can be put in a loop, see ``docs/own-robot.md``.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from numbers import Integral
from typing import Any, Generic, Protocol, TypeVar

import nengo
import numpy as np

from spikeport.constants import DT_S
from spikeport.errors import UsageError
from spikeport.experiments.clocks import PlantClock, SimulatorClock, controller_steps
from spikeport.experiments.port_values import commands, joined
from spikeport.node_functions import NO_INPUT, Skippable
from spikeport.reading.mismatch import shown

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
        self._ticks = controller_steps(plant.dt_s, dt_s)
        _check_ports(self._ports)
        places = [*_placed(self._ports, [port.size_in for port in self._ports])]
        # The gate is served first, but its values come last.
        self._served = [*places[len(listed) :], *places[: len(listed)]]
        self._n_gates = len(gates)
        self._tick = 0
        self._simulator_clock = SimulatorClock(dt_s)
        self._plant_clock = PlantClock(plant)
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
        self._tick = 0
        self._simulator_clock.begin()
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
        # The observation itself is held for the plant's whole step: callers may change theirs.
        return self._step(values).copy()

    def _step(self, values: np.ndarray) -> np.ndarray:
        self._tick += 1
        if self._tick % self._ticks == 0:
            self._advance(commands(values, self.size_in))
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
        self._simulator_clock.check(time_s, self._tick)
        return self._step(values)

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
        self._observation = joined(self._ports, observed, self.plant.time_s)
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
            If the ports have more or fewer values, one of the objects is no node, or the loop is
            already connected.
        """
        if self._is_connected:
            raise UsageError(
                "the loop is connected already, and a second controller would step its plant, too; "
                "cure: name all inputs and outputs in one connect(), or make another Loop"
            )
        _check_size("inputs take", inputs, "size_in", self.size_out)
        _check_size("outputs are", outputs, "size_out", self.size_in)
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


def _check_plant(plant: object) -> None:
    missing = [name for name in ("dt_s", "time_s", "step") if not hasattr(plant, name)]
    if missing:
        raise UsageError(
            f"Loop(plant, ports): {type(plant).__name__} has no {' and no '.join(missing)}; cure: "
            "a plant as SteppedPlant describes it"
        )
    for name in ("dt_s", "time_s"):
        _check_no_method(plant, name, "a number, in s")
    _check_no_method(plant, "has_own_clock", "True or False")


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


def _check_size(what: str, nodes: Sequence[nengo.Node], side: str, size: int) -> None:
    for node in nodes:
        if not hasattr(node, side):
            raise UsageError(
                f"Loop.connect(): {shown(node)} is no node; cure: name the controller's nodes, as "
                "in connect([network.state], [network.force])"
            )
    found = sum(getattr(node, side) for node in nodes)
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
