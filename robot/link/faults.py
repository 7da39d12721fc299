"""Faults between a controller and a robot in lock-step, on request and deterministic.

They befall commands, whose way is as long as that of states; time is the robot's own.
"""

import random
from collections.abc import Sequence

import numpy as np

from spikeport.fault_plan import Fault, FaultPlan, Faults
from spikeport.robot.link.codec import Command

KINDS = {
    "delay": "the command arrives so many ms later",
    "jitter": "it arrives later, by a time drawn from an exponential distribution of that mean",
    "loss": "it is lost",
    "duplicate": "it arrives again after the next one",
    "reorder": "it arrives after the next one",
    "nan": "one of its targets is not a number",
    "mute": "it is lost, and so are all that follow: the controller stopped",
    "stop": "the robot falls silent",
    "restart": "the robot begins anew, in its first posture",
}
"""The kinds of faults, and what becomes of the command of a step, or of the robot."""
FAULTS = Faults("--robot-fault", tuple(KINDS), timed=("delay", "jitter"))


class FaultyWay:
    """The way of commands to a robot, with faults by a plan.

    Parameters
    ----------
    step_ticks : int
        Length of a step, in ms.
    faults : sequence of Fault
        The plan.
    seed : int
        Draws steps of shares, and jitter.

    Attributes
    ----------
    kinds : frozenset of str
        The faults of the last step.
    """

    def __init__(self, step_ticks: int, faults: Sequence[Fault] = (), seed: int = 0) -> None:
        self._step_ticks = step_ticks
        self._rng = random.Random(seed)
        self._plan = FaultPlan(faults, self._rng)
        self._under_way: list[tuple[float, int, Command]] = []
        self._sent = 0
        self._mute = False
        self.kinds: frozenset[str] = frozenset()

    def send(self, step: int, tick: int, command: Command) -> None:
        """Send the command of a step at a tick in ms, unless a fault takes it."""
        faults = tuple(self._plan.drawn(step))
        self.kinds = frozenset(fault.kind for fault in faults)
        self._mute = self._mute or "mute" in self.kinds
        if self._mute or "loss" in self.kinds:
            return
        if "nan" in self.kinds:
            command = _with_nan(command)
        due = tick + sum(self._late_ms(fault) for fault in faults)
        if "reorder" not in self.kinds:
            self._add(due, command)
        if self.kinds & {"reorder", "duplicate"}:
            self._add(due + self._step_ticks, command, behind_next=True)

    def _late_ms(self, fault: Fault) -> float:
        if fault.kind == "jitter" and fault.delay_s > 0:
            return 1000 * self._rng.expovariate(1 / fault.delay_s)
        return 1000 * fault.delay_s

    def _add(self, due: float, command: Command, behind_next: bool = False) -> None:
        """Put a command on its way; of those that are due together, the later sent wins."""
        self._sent += 1
        self._under_way.append((due, self._sent + 2 * behind_next, command))

    def arrived(self, tick: int) -> list[Command]:
        """Return the commands that have arrived by a tick in ms, in their order."""
        due = sorted((one for one in self._under_way if one[0] <= tick), key=lambda one: one[:2])
        self._under_way = [one for one in self._under_way if one[0] > tick]
        return [command for _, _, command in due]


def _with_nan(command: Command) -> Command:
    q = command.motors.q.copy()
    q[0] = np.nan
    return command._replace(motors=command.motors._replace(q=q))
