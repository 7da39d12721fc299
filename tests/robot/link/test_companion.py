"""Messages beside the states: the newest counts, and that of a tick is waited for on request."""

import numpy as np

from spikeport.robot.link.codec import Base, encode_base
from spikeport.robot.link.companion import Companion
from tests.helpers.fake_bus import FakeReader


def message(tick: int) -> bytes:
    return encode_base(Base(tick, np.zeros(3), np.zeros(3)))


def test_the_newest_counts_and_nothing_is_waited_for_unless_asked() -> None:
    reader = FakeReader(lambda: reader.queue.append(message(20)))
    companion = Companion(reader)
    companion.take(20, waits=False)
    assert (companion.newest, companion.came) == (None, 0)
    reader.queue.extend([message(5), message(10), b"nonsense"])
    companion.take(20, waits=False)
    assert companion.newest is not None
    assert (companion.newest.tick, companion.came, companion.damaged) == (10, 2, 1)
    companion.take(20, waits=True)
    assert companion.newest.tick == 20
    assert companion.published


def test_a_publisher_that_fell_silent_is_not_waited_for() -> None:
    companion = Companion(FakeReader(lambda: None))
    companion.take(5, waits=True)
    assert companion.newest is None
