"""``spikeport robot serve``: a process that acts as a robot, for one controller at a time."""

import json
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

from spikeport.fault_plan import Fault
from spikeport.pacing import Deadlines, SystemClock, undisturbed
from spikeport.robot.link.bus import Bus
from spikeport.robot.link.lock_step import LockStep, Published
from spikeport.robot.link.messages import COMMANDS, ODOMETRY, STATES, TRUTHS
from spikeport.robot.link.motion_switcher import SwitcherService
from spikeport.robot.link.place import Place
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.terminal import Terminal, own_terminal

AGAIN_S = 0.05
"""Time after which an unanswered state is published again, in lock-step."""
HOIST_KEY = "l"
SLICE_S = 0.2
"""Time between two checks whether the controller is still there."""


@dataclass(frozen=True, kw_only=True)
class Service:
    """The settings of a server.

    Attributes
    ----------
    place : Place
        The domain and interface of the robot's topics.
    robot : RobotSettings
        The robot.
    lock_step : bool
        True if the robot waits for the answer to each state; otherwise it runs in real time.
    truth : bool
        True if the robot publishes place and velocity of its pelvis.
    faults : sequence of Fault
        A plan of faults, for lock-step.
    once : bool
        True to end when the first controller is gone.
    idle_s : float, optional
        Time without a controller after which the server ends.
    priority : int, optional
        The real-time priority of the process, outside lock-step.
    """

    place: Place
    robot: RobotSettings
    lock_step: bool = False
    truth: bool = False
    faults: Sequence[Fault] = ()
    once: bool = False
    idle_s: float | None = None
    priority: int | None = None


class Interface:
    """The robot's ends of its topics, and a record of when a controller was at the other ends.

    Parameters
    ----------
    bus : Bus
        The bus of the topics.
    service : Service
        The settings: the published topics, and when to stop waiting for a controller.
    """

    def __init__(self, bus: Bus, service: Service) -> None:
        self.commands = bus.reader(COMMANDS)
        self._states = bus.writer(STATES)
        self._truths = bus.writer(TRUTHS) if service.truth else None
        self._odometry = bus.writer(ODOMETRY) if service.robot.odometer else None
        self._once, self._idle_s = service.once, service.idle_s
        self._met = False
        self._alone_since = time.monotonic()

    def publish(self, messages: Published) -> None:
        """Send the messages of a tick, its state last, as that completes the tick."""
        if self._truths is not None and messages.truth is not None:
            self._truths.write(messages.truth)
        if self._odometry is not None and messages.odometry is not None:
            self._odometry.write(messages.odometry)
        self._states.write(messages.state)

    def note(self, writers: list[int]) -> bool:
        """Note who writes now; return whether the controller is gone for good, or never came."""
        now = time.monotonic()
        if writers:
            self._met, self._alone_since = True, now
            return False
        if self._met and self._once:
            return True
        return self._idle_s is not None and now - self._alone_since > self._idle_s


class Attendant:
    """The robot's surroundings: its motion switcher, and the hand on its hoist.

    Parameters
    ----------
    bus : Bus
        The bus of the motion switcher.
    robot : SimulatedRobot
        The robot.
    terminal : Terminal
        Its key `HOIST_KEY` pulls the hoist.
    say : callable
        Prints a line when the hoist lowers the robot and when it lets go.
    """

    def __init__(
        self, bus: Bus, robot: SimulatedRobot, terminal: Terminal, say: Callable[[str], None]
    ) -> None:
        self._switcher = SwitcherService(bus, robot)
        self._robot, self._terminal, self._say = robot, terminal, say
        self._shown = robot.hoist.held

    def look(self) -> None:
        """Handle the requests and keys since the last look."""
        self._switcher.serve()
        hoist = self._robot.hoist
        for _ in range(self._terminal.keys().count(HOIST_KEY)):
            hoist.advance()
        if hoist.held is not self._shown:
            self._shown = hoist.held
            self._say(f"robot: {hoist.held.value}")


def serve(service: Service, say: Callable[[str], None]) -> None:
    """Act as a robot until the process or the settings end it; then report.

    Parameters
    ----------
    service : Service
        The settings.
    say : callable
        Prints a line.

    Raises
    ------
    MissingExtraError, BackendError
        If DDS cannot begin.
    DivergedError
        If the simulation diverged.
    """
    robot = SimulatedRobot(service.robot)
    place = service.place
    # In lock-step, nothing reads keys while commands keep coming.
    by_hand = service.robot.hoist and not service.lock_step
    with (
        Bus(place, reliable=service.lock_step) as bus,
        closing(own_terminal() if by_hand else Terminal(None)) as terminal,
    ):
        interface, attendant = Interface(bus, service), Attendant(bus, robot, terminal, say)
        deadlines = Deadlines(1 / service.robot.rate_hz, SystemClock())
        lock_step = LockStep(robot, service.faults, service.truth) if service.lock_step else None

        def report() -> None:
            for line in lock_step.never_reached() if lock_step else ():
                say(f"robot: {line}")
            say(f"robot: {json.dumps({**robot.summary(), 'overruns': deadlines.overruns})}")

        clock = "lock-step" if service.lock_step else f"{service.robot.rate_hz:g} Hz"
        try:  # a reader of the first line may end the process before the next statement
            say(f"robot: H1 on {place.interface}, domain {place.domain}, {clock}")
            if lock_step is not None:
                serve_lock_step(lock_step, interface, attendant, report)
            else:
                with undisturbed(service.priority):
                    serve_real_time(robot, interface, attendant, service.truth, deadlines)
        finally:
            report()


def serve_lock_step(
    robot: LockStep, interface: Interface, attendant: Attendant, report: Callable[[], None]
) -> None:
    """Publish a state, wait for its answer and step, until the controller is gone.

    For the next controller, if there may be one, the robot begins anew after ``report``, so that
    this run, too, depends only on its seeds.
    """
    looked_s = time.monotonic()
    while True:
        if not robot.silent:
            interface.publish(robot.published())
        # A state or its answer may be lost, so the state is published again after this time.
        arrivals = interface.commands.take(AGAIN_S)
        for arrival in arrivals:
            robot.take_answer(arrival.message, arrival.writer)
        # Not after every answer, but also if another process writes without end.
        if arrivals and time.monotonic() - looked_s < SLICE_S:
            continue
        looked_s = time.monotonic()
        attendant.look()
        writers = interface.commands.writers  # read once: a controller may leave between two reads
        if interface.note(writers):
            return
        if robot.is_left(writers):
            report()
            robot.restart()


def serve_real_time(
    robot: SimulatedRobot,
    interface: Interface,
    attendant: Attendant,
    truth: bool,
    deadlines: Deadlines,
) -> None:
    """Publish, obey and step by the clock, until the controller is gone.

    Time stands still until the first command: a robot on its feet would fall while it waits.
    """
    looked_s = time.monotonic()
    while True:
        deadlines.begin()
        for arrival in interface.commands.take():
            command = robot.read(arrival.message, arrival.writer)
            if command is not None:
                robot.obey(command)
        if not robot.waits:
            robot.step()
        interface.publish(
            Published(robot.state(), robot.truth() if truth else None, robot.odometry())
        )
        # Not in every step, as processes rarely come and go.
        if time.monotonic() - looked_s >= SLICE_S:
            looked_s = time.monotonic()
            attendant.look()
            writers = interface.commands.writers
            if robot.is_left(writers):
                robot.forget_writer()
            if interface.note(writers):
                return
