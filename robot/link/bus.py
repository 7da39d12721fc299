"""Unitree's topics over DDS, as bytes: the only module that sends and receives by cyclonedds.

A participant is confined to one interface. On loopback, multicast is off, and the other side is
found by its address. The sockets listen on all interfaces, whatever is configured (docs/robot.md).
"""

from typing import NamedTuple, Self
from uuid import UUID

from spikeport.errors import BackendError
from spikeport.extras import missing
from spikeport.robot.link.messages import Topic
from spikeport.robot.link.place import LOOPBACK, Place
from spikeport.robot.link.wire import WORD

try:
    from cyclonedds._clayer import ddspy_take, ddspy_write
    from cyclonedds.core import (
        DDSException,
        Entity,
        InstanceState,
        ReadCondition,
        SampleState,
        ViewState,
        WaitSet,
    )
    from cyclonedds.domain import Domain, DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic as DdsTopic
    from cyclonedds.util import duration

    from spikeport.robot.link.idl import idl_type
except ImportError as error:
    reason = f"cannot be imported ({error})"
    raise missing("a robot's interface", "cyclonedds", "link", reason) from error

LEASE_S = 5
"""Time after which a process that was killed, and so did not say that it leaves, counts as gone."""
XCDR1 = bytes((0, 1, 0, 0))
"""The head of a message: CDR, little-endian."""
MOST_TAKEN = 64
"""The most messages of a topic that are kept; `Reader.take` returns all of them at once."""

_CONFINED = """<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface name="{name}"
{multicast}/></Interfaces>{allow}</General><Discovery><ParticipantIndex>auto</ParticipantIndex>
{peers}<LeaseDuration>{lease}s</LeaseDuration></Discovery></Domain></CycloneDDS>"""
_LOOPBACK = {
    "multicast": 'multicast="false"',
    "allow": "<AllowMulticast>false</AllowMulticast>",
    "peers": '<Peers><Peer address="127.0.0.1"/></Peers>',
}


class Arrival(NamedTuple):
    """A message that came: its bytes, and its writer's `Writer.number`."""

    message: bytes
    writer: int


class Bus:
    """A participant of DDS, and its readers and writers.

    Parameters
    ----------
    place : Place
        The domain and interface of the participant.
    reliable : bool
        True if readers request lost messages again, as lock-step needs; otherwise they stay lost,
        as with Unitree's readers.

    Attributes
    ----------
    place : Place
        See the parameter.

    Raises
    ------
    MissingExtraError
        If cyclonedds is absent.
    BackendError
        If DDS cannot begin there.
    """

    def __init__(self, place: Place, *, reliable: bool) -> None:
        self.place, self._reliable = place, reliable
        rest = _LOOPBACK if place.interface == LOOPBACK else dict.fromkeys(_LOOPBACK, "")
        config = _CONFINED.format(name=place.interface, lease=LEASE_S, **rest)
        self._entities: list[Entity] = []
        try:
            # Made first and closed last: the participant lives in it.
            self._entities.append(Domain(place.domain, config))
            self._participant = DomainParticipant(place.domain)
            self._entities.append(self._participant)
        except DDSException as error:
            raise BackendError(
                f"DDS cannot begin on {place.interface}, domain {place.domain}: {error.msg}"
            ) from None

    def writer(self, topic: Topic) -> "Writer":
        """Return a writer of a topic."""
        made = Writer(self._participant, topic)
        self._entities += made.entities
        return made

    def reader(self, topic: Topic, *, reliable: bool = False) -> "Reader":
        """Return a reader of a topic, reliable if this or the bus is; see `Bus`."""
        made = Reader(self._participant, topic, reliable or self._reliable)
        self._entities += made.entities
        return made

    def close(self) -> None:
        """Leave the domain; the other side notices at once."""
        while self._entities:
            self._entities.pop().__del__()  # its parent still exists

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Writer:
    """A writer of a topic; `Bus.writer` makes one."""

    def __init__(self, participant: DomainParticipant, topic: Topic) -> None:
        named = DdsTopic(participant, topic.name, idl_type(topic.message))
        self._writer = DataWriter(participant, named)
        self.entities = (named, self._writer)

    def write(self, message: bytes) -> None:
        """Send a message."""
        data = XCDR1 + message
        # DDS takes whole words.
        code = ddspy_write(self._writer._ref, data + bytes(-len(data) % WORD))
        if code < 0:
            raise BackendError(f"DDS cannot write (code {code})")

    @property
    def number(self) -> int:
        """The number of this writer, which is the same for all readers."""
        return _number(self._writer.guid)

    @property
    def n_readers(self) -> int:
        """The number of readers that are there."""
        return int(self._writer.get_publication_matched_status().current_count)


class Reader:
    """A reader of a topic; `Bus.reader` makes one."""

    def __init__(self, participant: DomainParticipant, topic: Topic, reliable: bool) -> None:
        kind = idl_type(topic.message)
        # The latest state wins: repeating a lost one would only delay later ones.
        reliability = Policy.Reliability.BestEffort
        if reliable:
            reliability = Policy.Reliability.Reliable(duration(seconds=1))
        # The writers share this history. With room for one message, a second writer's messages
        # would push out the first writer's, and nobody would notice that two write.
        qos = Qos(reliability, Policy.History.KeepLast(MOST_TAKEN))
        named = DdsTopic(participant, topic.name, kind)
        self._reader = DataReader(participant, named, qos)
        self._any = SampleState.Any | ViewState.Any | InstanceState.Any
        condition = ReadCondition(self._reader, self._any)
        self._waits = WaitSet(participant)
        self._waits.attach(condition)
        self.entities = (named, self._reader, condition, self._waits)
        self._numbers: dict[int, int] = {}

    def take(self, within_s: float = 0.0) -> list[Arrival]:
        """Return the messages that have come, or come within a time, oldest first."""
        if within_s > 0:
            self._waits.wait(int(1e9 * within_s))
        found = ddspy_take(self._reader._ref, self._any, MOST_TAKEN)
        if isinstance(found, int):
            raise BackendError(f"DDS cannot read (code {found})")
        return [
            Arrival(data[len(XCDR1) :], self._written_by(info.publication_handle))
            for data, info in found
            # A writer that leaves sends a sample without data.
            if info.valid_data and data.startswith(XCDR1)
        ]

    @property
    def n_writers(self) -> int:
        """The number of writers that are there."""
        return int(self._reader.get_subscription_matched_status().current_count)

    @property
    def writers(self) -> list[int]:
        """The numbers of the writers that are there."""
        # handles are signed here, but unsigned in the info of a message
        return [
            self._written_by(int(handle) % 2**64)
            for handle in self._reader.get_matched_publications()
        ]

    def _written_by(self, handle: int) -> int:
        """Return a writer's number; if it is gone, its handle, which only this process knows."""
        if handle not in self._numbers:
            try:
                found = self._reader.get_matched_publication_data(handle)
            except DDSException:
                found = None
            if found is None:
                return handle
            self._numbers[handle] = _number(found.key)
        return self._numbers[handle]


def _number(guid: UUID) -> int:
    """Return the 128 bits of an endpoint's identity, folded to 64."""
    # 64 bits, as a state names its controller in the two words of `sn`.
    return (guid.int >> 64) ^ (guid.int % 2**64)
