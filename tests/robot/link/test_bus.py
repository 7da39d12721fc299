"""The DDS bus: whole messages in order, each with its writer, and a close that leaves nothing."""

import time

import pytest

from tests.helpers.namespace import in_namespace, missing

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing() or "all is there")


def exchanged() -> dict[str, object]:
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import STATES
    from spikeport.robot.link.place import Place

    with Bus(Place(), reliable=True) as bus:
        reader, writer, other = bus.reader(STATES), bus.writer(STATES), bus.writer(STATES)
        while len(reader.writers) < 2 or not writer.n_readers:
            time.sleep(0.01)
        for number in range(20):
            writer.write(bytes([number]) * 1176)
        found = []
        while len(found) < 20:
            found += reader.take(0.2)
        other.write(bytes(1176))
        (last,) = reader.take(2.0)
        numbers = [arrival.message[0] for arrival in found]
        whole = all(a.message == bytes([a.message[0]]) * 1176 for a in found)
        return {
            "numbers": numbers,
            "whole": whole,
            "writers": len({arrival.writer for arrival in (*found, last)}),
            "named": [found[0].writer, last.writer] == [writer.number, other.number],
            "known": {arrival.writer for arrival in (*found, last)} == set(reader.writers),
            "none": reader.take(0.01),
        }


@pytest.mark.slow
def test_messages_arrive_whole_in_order_and_with_their_writer() -> None:
    assert in_namespace(exchanged) == {
        "numbers": list(range(20)),
        "whole": True,
        "writers": 2,
        "named": True,
        "known": True,
        "none": [],
    }


def in_between() -> list[tuple[int, bool]]:
    """Return the numbers of four messages, and whether the first of two writers wrote them."""
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import STATES
    from spikeport.robot.link.place import Place

    with Bus(Place(), reliable=False) as bus:
        reader, first, other = bus.reader(STATES), bus.writer(STATES), bus.writer(STATES)
        while len(reader.writers) < 2:
            time.sleep(0.01)
        for number, writer in enumerate((first, other, first, first)):
            writer.write(bytes([number]) * 1176)
        time.sleep(0.2)
        return [(arrival.message[0], arrival.writer == first.number) for arrival in reader.take()]


@pytest.mark.slow
def test_in_real_time_messages_of_a_second_writer_displace_none_of_the_first() -> None:
    found = in_namespace(in_between)
    assert found == [[0, True], [1, False], [2, True], [3, True]]


def late() -> list[int]:
    """Return the numbers of the messages that a reader gets after 100 were written."""
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import STATES
    from spikeport.robot.link.place import Place

    with Bus(Place(), reliable=False) as bus:
        reader, writer = bus.reader(STATES), bus.writer(STATES)
        while not reader.writers:
            time.sleep(0.01)
        for number in range(100):
            writer.write(bytes([number]) * 1176)
        time.sleep(0.2)
        taken = [arrival.message[0] for arrival in reader.take()]
        assert not reader.take()
        return taken


@pytest.mark.slow
def test_in_real_time_a_late_reader_takes_the_newest_64_messages_at_once() -> None:
    assert in_namespace(late) == list(range(36, 100))


def again() -> list[str]:
    """Open and close a bus twice, and return the sockets and threads that are left."""
    import threading
    from pathlib import Path

    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import STATES
    from spikeport.robot.link.place import Place

    for _ in range(2):
        with Bus(Place(), reliable=True) as bus:
            bus.reader(STATES)
    rows = Path("/proc/net/udp").read_text().splitlines()[1:]
    return [*rows, *(thread.name for thread in threading.enumerate()[1:])]


@pytest.mark.slow
def test_a_closed_bus_leaves_no_socket_or_thread_and_can_be_opened_again() -> None:
    assert in_namespace(again) == []


def refused() -> str:
    from spikeport.errors import BackendError
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.place import Place

    with Bus(Place(), reliable=True):
        try:
            Bus(Place(), reliable=True)
        except BackendError as error:
            return str(error)
    return ""


@pytest.mark.slow
def test_a_second_bus_in_the_same_process_and_domain_is_refused() -> None:
    assert "DDS cannot begin on lo, domain 1" in in_namespace(refused)
