"""The interface of a robot: CPU time of a state and a command, and latencies at three rates.

    unshare -n sh -c 'ip link set lo up; exec python benchmarks/robot_link.py'

The robot here is an echo without physics, in a process of its own; DDS is on loopback. CPU time
counts all threads of both processes. Latencies and misses depend on what else the machine does.
"""

import os
import time
from collections.abc import Callable

import numpy as np

from spikeport.pacing import Deadlines, RoundTrips, SystemClock
from spikeport.robot.link.bus import Bus
from spikeport.robot.link.codec import (
    Command,
    decode_command,
    decode_state,
    encode_command,
    encode_state,
)
from spikeport.robot.link.messages import COMMANDS, STATES
from spikeport.robot.link.place import Place
from spikeport.robot.link.robot import DAMPING
from spikeport.robot.link.signals import Sensors

READINGS = Sensors(0.0, np.array([1.0, 0, 0, 0]), *np.zeros((2, 3)), *np.ones((3, 19)))
REPEATS = 5000
STEPS = 3000
SECONDS = 5.0
DOMAIN = 9


def us_each(call: Callable[[], object]) -> float:
    """Return the CPU time of a call, in us, in mean."""
    for _ in range(REPEATS // 10):
        call()
    begin = time.process_time()
    for _ in range(REPEATS):
        call()
    return 1e6 * (time.process_time() - begin) / REPEATS


def layouts() -> None:
    """Print what messages cost without a link."""
    state, command = encode_state(5, READINGS), encode_command(Command(5, DAMPING))
    parts = {
        "state written": us_each(lambda: encode_state(5, READINGS)),
        "state read": us_each(lambda: decode_state(state)),
        "command written": us_each(lambda: encode_command(Command(5, DAMPING))),
        "command read": us_each(lambda: decode_command(command)),
    }
    for name, us in parts.items():
        print(f"{name:32} {us:6.1f} us")
    print(f"{'all four, with checksums':32} {sum(parts.values()):6.1f} us")


def controller(n: int, pipe: int) -> None:
    """Answer states until the n-th, and report states that came, and CPU time."""
    with Bus(Place(domain=DOMAIN), keeps_all=n > 0) as bus:
        reader, writer = bus.reader(STATES), bus.writer(COMMANDS)
        while not reader.writers:
            time.sleep(0.01)
        begin, came = time.process_time(), 0
        while reader.writers:
            for arrival in reader.take(0.2):
                tick, _ = decode_state(arrival.message)
                writer.write(encode_command(Command(tick, DAMPING)))
                came += 1
        cpu_s = time.process_time() - begin
    os.write(pipe, f"{came} {cpu_s}\n".encode())


def with_controller(robot: Callable[[Bus], float], n: int) -> tuple[float, int, float]:
    """Run an echo against a controller; returns what it returns, states that came, CPU time."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        controller(n, write)
        os._exit(0)
    with Bus(Place(domain=DOMAIN), keeps_all=n > 0) as bus:
        found = robot(bus)
    os.waitpid(child, 0)
    came, cpu_s = os.read(read, 100).split()
    return found, int(came), float(cpu_s)


def lock_step(bus: Bus) -> float:
    """Publish and wait for the answer, so often; returns CPU time."""
    writer, reader = bus.writer(STATES), bus.reader(COMMANDS)
    while not (reader.writers and writer.n_readers):
        time.sleep(0.01)
    begin = time.process_time()
    for tick in range(1, STEPS + 1):
        answered = False
        while not answered:
            writer.write(encode_state(tick, READINGS))
            answers = [decode_command(a.message).answers for a in reader.take(0.2)]
            answered = tick in answers
    return time.process_time() - begin


def paced(hz: int) -> Callable[[Bus], float]:
    """Return an echo at a rate, which prints latencies and returns how many states it sent."""

    def run(bus: Bus) -> float:
        writer, reader = bus.writer(STATES), bus.reader(COMMANDS)
        while not (reader.writers and writer.n_readers):
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
        return float(n)

    return run


def main() -> None:
    layouts()
    robot_s, _, controller_s = with_controller(lock_step, STEPS)
    for name, cpu_s in (("robot", robot_s), ("controller", controller_s)):
        print(f"{f'lock-step over DDS, {name}':32} {1e6 * cpu_s / STEPS:6.1f} us of CPU a step")
    for hz in (200, 500, 1000):
        sent, came, _ = with_controller(paced(hz), 0)
        print(f", {sent - came:.0f} of {sent:.0f} states missed")


if __name__ == "__main__":
    main()
