"""Faults between a controller and a robot in lock-step, on request and deterministic.

They affect commands or, with the prefix ``state-``, states; times are the robot's own.
"""

import dataclasses
import random
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

from spikeport.errors import UsageError
from spikeport.fault_plan import Fault, FaultPlan, Faults, unreached

Message = TypeVar("Message")

_ON_MESSAGES = {
    "delay": "it arrives this many ms later",
    "jitter": "it arrives later, by a random time, exponentially distributed with this mean",
    "loss": "it is lost",
    "duplicate": "it arrives again after the next one",
    "reorder": "it arrives after the next one",
    "nan": "one of its angles is not a number",
    "mute": "it is lost, and so are all that follow",
}
STATE = "state-"
"""The prefix of the faults that affect states."""
KINDS = {
    **_ON_MESSAGES,
    "stop": "the robot falls silent",
    "restart": "the robot begins anew, in its first posture",
    **{f"{STATE}{kind}": effect for kind, effect in _ON_MESSAGES.items()},
}
"""The kinds of faults, and their effects on the command or state of a step, or on the robot."""


class RobotFaults(Faults):
    """The faults that the link to a robot can have."""

    def parse(self, text: str) -> Fault:
        """Return the fault that a text names; UsageError if invalid, or if it has no effect."""
        fault = super().parse(text)
        if fault.kind == "restart" and fault.step == 1:
            raise UsageError(
                f"{self.option} {text!r}: at its first step the robot has only begun; "
                "cure: a step from 2 on"
            )
        if fault.kind.startswith(STATE) and fault.step == 1:
            raise UsageError(
                f"{self.option} {text!r}: the first state always arrives; cure: a step from 2 on"
            )
        return fault


FAULTS = RobotFaults(
    "--robot-fault", tuple(KINDS), ("delay", "jitter", f"{STATE}delay", f"{STATE}jitter")
)


def of_states(faults: Sequence[Fault]) -> list[Fault]:
    """Return the faults of states, without the prefix of their kinds."""
    return [
        dataclasses.replace(fault, kind=fault.kind.removeprefix(STATE))
        for fault in faults
        if fault.kind.startswith(STATE)
    ]


def of_commands(faults: Sequence[Fault]) -> list[Fault]:
    """Return the faults of commands, and of the robot."""
    return [fault for fault in faults if not fault.kind.startswith(STATE)]


def never_reached(faults: Sequence[Fault], commands: int) -> list[str]:
    """Return a line for each fault beyond the end of a run, which has one state more."""
    late = [one for one in faults if not (one.kind.startswith(STATE) and one.step == commands + 1)]
    return unreached(late, commands, "the robot's run")


class FaultyWay(Generic[Message]):
    """The path of messages to the other side, with the faults of a plan.

    Parameters
    ----------
    step_ticks : int
        Length of a step, in ms.
    spoil : callable
        Returns a message with an angle that is not a number.
    faults : sequence of Fault
        The plan.
    seed : int
        Seed that draws jitter, and the steps of faults with a share.

    Attributes
    ----------
    kinds : frozenset of str
        The kinds of the faults in the last step.
    """

    def __init__(
        self,
        step_ticks: int,
        spoil: Callable[[Message], Message],
        faults: Sequence[Fault] = (),
        seed: int = 0,
    ) -> None:
        self._step_ticks, self._spoil = step_ticks, spoil
        self._rng = random.Random(seed)
        self._plan = FaultPlan(faults, self._rng)
        self._under_way: list[tuple[float, int, Message]] = []
        self._sent = 0
        self._mute = False
        self.kinds: frozenset[str] = frozenset()

    def send(self, step: int, tick: int, message: Message) -> None:
        """Send the message of a step at a tick in ms, unless a fault drops it."""
        faults = tuple(self._plan.drawn(step))
        self.kinds = frozenset(fault.kind for fault in faults)
        self._mute = self._mute or "mute" in self.kinds
        if self._mute or "loss" in self.kinds:
            return
        if "nan" in self.kinds:
            message = self._spoil(message)
        # Delay and jitter of one message add up.
        due = tick + sum(self._late_ms(fault) for fault in faults)
        if "reorder" not in self.kinds:
            self._add(due, message)
        if self.kinds & {"reorder", "duplicate"}:
            self._add(due + self._step_ticks, message, behind_next=True)

    def _late_ms(self, fault: Fault) -> float:
        if fault.kind == "jitter" and fault.delay_s > 0:
            return 1000 * self._rng.expovariate(1 / fault.delay_s)
        return 1000 * fault.delay_s

    def _add(self, due: float, message: Message, behind_next: bool = False) -> None:
        """Put a message on its way; if two are due together, the one that was sent later wins."""
        self._sent += 1
        # One more than the next message's number puts it behind that one, if both are due together.
        self._under_way.append((due, self._sent + 2 * behind_next, message))

    def arrived(self, tick: int) -> list[Message]:
        """Return the messages that have arrived by a tick in ms, in their order."""
        due = sorted((one for one in self._under_way if one[0] <= tick), key=lambda one: one[:2])
        self._under_way = [one for one in self._under_way if one[0] > tick]
        return [message for _, _, message in due]
