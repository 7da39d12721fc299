"""The interface of a robot: CPU time of a state and a command, and latencies at three rates.

    unshare -n sh -c 'ip link set lo up; exec python benchmarks/robot_link.py'
    unshare -n sh -c 'ip link set lo up; exec python benchmarks/robot_link.py --priority 10'

The robot here is an echo without physics, in a process of its own; DDS is on loopback. CPU time
counts all threads of both processes. Latencies and misses depend on what else the machine does;
a priority applies to both processes at the three rates.
"""

import argparse
import contextlib
import itertools
import json
import os
import signal
import statistics
import time
import traceback
from collections.abc import Callable, Iterator
from typing import NoReturn, TypeVar

import numpy as np

from spikeport.pacing import Deadlines, RoundTrips, SystemClock, undisturbed
from spikeport.robot.link.bus import Bus
from spikeport.robot.link.codec import (
    Command,
    decode_command,
    decode_state,
    encode_command,
    encode_state,
)
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.messages import COMMANDS, STATES
from spikeport.robot.link.place import Place
from spikeport.robot.signals import Sensors

R = TypeVar("R")
READINGS = Sensors(0.0, np.array([1.0, 0, 0, 0]), *np.zeros((2, 3)), *np.ones((3, 19)))
BATCH = 500
BATCHES = 12
"""Batches, whose least and median times are printed: the median also has the effects of other
processes on caches and clock."""
SECONDS = 5.0
DOMAIN = 9


def batches(call: Callable[[], object]) -> list[float]:
    """Return the mean CPU time of a call in each batch, in us."""
    found = []
    for _ in range(BATCHES):
        begin = time.process_time()
        for _ in range(BATCH):
            call()
        found.append(1e6 * (time.process_time() - begin) / BATCH)
    return found


def show(name: str, us: list[float]) -> None:
    """Print CPU times."""
    print(f"{name:32} {min(us):6.1f} us, median {statistics.median(us):6.1f} us")


def layouts() -> None:
    """Print the CPU times of messages without a link."""
    state, command = encode_state(5, READINGS), encode_command(Command(5, DAMPING))
    show("state written", batches(lambda: encode_state(5, READINGS)))
    show("state read", batches(lambda: decode_state(state)))
    show("command written", batches(lambda: encode_command(Command(5, DAMPING))))
    show("command read", batches(lambda: decode_command(command)))


def in_one_process() -> None:
    """Print the CPU time of a state and its answer, with DDS in one process."""
    with Bus(Place(domain=DOMAIN), reliable=True) as bus:
        states, to_controller = bus.reader(STATES), bus.writer(STATES)
        commands, to_robot = bus.reader(COMMANDS), bus.writer(COMMANDS)
        while not (states.n_writers and commands.n_writers):
            time.sleep(0.01)

        def trip() -> None:
            to_controller.write(encode_state(5, READINGS))
            (state,) = states.take(0.2)
            tick, _ = decode_state(state.message)
            to_robot.write(encode_command(Command(tick, DAMPING)))
            (answer,) = commands.take(0.2)
            decode_command(answer.message)

        show("all four, and DDS in a process", batches(trip))


def controller(n: int, pipe: int) -> None:
    """Answer states until the robot leaves, and report the number of states and CPU times."""
    with Bus(Place(domain=DOMAIN), reliable=n > 0) as bus:
        reader, writer = bus.reader(STATES), bus.writer(COMMANDS)
        while not reader.n_writers:
            time.sleep(0.01)
        times, came = [time.process_time()], 0
        while reader.n_writers:
            for arrival in reader.take(0.2):
                tick, _ = decode_state(arrival.message)
                writer.write(encode_command(Command(tick, DAMPING)))
                came += 1
                if came % BATCH == 0:
                    times.append(time.process_time())
    os.write(pipe, json.dumps([came, us_of(times)]).encode())


def us_of(times: list[float]) -> list[float]:
    """Return the CPU time of a step in each batch, in us, from the times at the batches' ends."""
    return [1e6 * (end - begin) / BATCH for begin, end in itertools.pairwise(times)]


def with_controller(robot: Callable[[Bus], R], n: int) -> tuple[R, int, list[float]]:
    """Run an echo with a controller; returns its result, the number of states and CPU times.

    Raises
    ------
    ChildProcessError
        The controller has ended before the robot, or without its result.
    """
    read, write = os.pipe()
    with os.fdopen(read) as pipe, _controlled(n, write) as watch:
        with Bus(Place(domain=DOMAIN), reliable=n > 0) as bus:
            found = robot(bus)
            watch.close()  # the controller ends as the bus closes
        report = pipe.read()
    if not report:
        raise ChildProcessError("the controller ended without its result; see the error above")
    came, times = json.loads(report)
    return found, came, times


@contextlib.contextmanager
def _controlled(n: int, pipe: int) -> Iterator[contextlib.ExitStack]:
    """Have a controller in a process, and yield its watch, which raises an error if it ends."""
    with contextlib.ExitStack() as watch:
        # Without its controller, the robot would wait for ever.
        watch.callback(signal.signal, signal.SIGCHLD, signal.signal(signal.SIGCHLD, _lost))
        child = os.fork()
        if child == 0:
            _serve(n, pipe)
        try:
            os.close(pipe)
            yield watch
        except BaseException:
            watch.close()
            os.kill(child, signal.SIGKILL)
            raise
        finally:
            os.waitpid(child, 0)


def _serve(n: int, pipe: int) -> NoReturn:
    """Be the controller, and end the process: it must not go on as its parent."""
    code = 1
    try:
        controller(n, pipe)
        code = 0
    except BaseException:  # also of an interrupt: see above
        traceback.print_exc()
    finally:
        os._exit(code)


def _lost(_signal: int, _frame: object) -> NoReturn:
    raise ChildProcessError("the controller ended before the robot; see the error above")


def lock_step(bus: Bus) -> list[float]:
    """Publish states, and wait for the answer to each; returns CPU times."""
    writer, reader = bus.writer(STATES), bus.reader(COMMANDS)
    while not (reader.n_writers and writer.n_readers):
        time.sleep(0.01)
    times = [time.process_time()]
    for tick in range(1, BATCHES * BATCH + 1):
        answered = False
        while not answered:
            writer.write(encode_state(tick, READINGS))
            answers = [decode_command(a.message).answers for a in reader.take(0.2)]
            answered = tick in answers
        if tick % BATCH == 0:
            times.append(time.process_time())
    return us_of(times)


def paced(hz: int) -> Callable[[Bus], int]:
    """Return an echo at a rate, which prints latencies and returns how many states it sent."""

    def run(bus: Bus) -> int:
        writer, reader = bus.writer(STATES), bus.reader(COMMANDS)
        while not (reader.n_writers and writer.n_readers):
            time.sleep(0.01)
        deadlines, trips = Deadlines(1 / hz, SystemClock()), RoundTrips()
        n = round(SECONDS * hz)
        for tick in range(1, n + 1):
            end = deadlines.begin()
            sent = time.perf_counter()
            writer.write(encode_state(tick, READINGS))
            while (left := end - time.perf_counter()) > 0:
                answers = [decode_command(a.message).answers for a in reader.take(left)]
                if tick in answers:
                    trips.add(time.perf_counter() - sent)
                    break
        print(
            f"{hz:5} Hz: round trip {trips.summary_us()} us, {deadlines.overruns} overruns", end=""
        )
        return n

    return run


def main() -> None:
    """Print the times of messages, in lock-step and at three rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--priority", type=int)
    asked = parser.parse_args()
    layouts()
    in_one_process()
    robot_us, _, controller_us = with_controller(lock_step, BATCHES * BATCH)
    show("a lock-step over DDS, robot", robot_us)
    show("a lock-step over DDS, controller", controller_us)
    with undisturbed(asked.priority):  # the controller's process inherits it
        for hz in (200, 500, 1000):
            sent, came, _ = with_controller(paced(hz), 0)
            print(f", {sent - came} of {sent} states missed")


if __name__ == "__main__":
    main()
