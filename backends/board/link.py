"""The options of a link: the board, its clock, and a record."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from spikeport.errors import UsageError
from spikeport.key_values import check_fields

if TYPE_CHECKING:
    from spikeport.backends.board.address import Certificates

STUB = "stub"


@dataclass(frozen=True)
class LinkOptions:
    """The link to a board.

    Attributes
    ----------
    board : str
        ``"stub"`` starts a server and ends it; else ``unix:PATH`` or ``tcp://HOST:PORT``.
    real_time : bool
        True if steps keep to the clock of this machine, rather than wait for the board.
    hold : int
        In real time, the steps for which outputs are held while the board is late.
    faults : tuple of str
        A plan of faults for the stub, see `spikeport.backends.board.faults`.
    record : Path, optional
        A file to record the session in; a text becomes a path. An earlier record in it is replaced
        once a session begins, also by the session that `Simulator.reset` begins.
    replay : Path, optional
        A record that the backend ``replay`` plays back; a text becomes a path.
    certificates : Certificates, optional
        Files of TLS.

    Raises
    ------
    UsageError
        If a value has another type, or ``hold`` is below 0.
    """

    board: str = STUB
    real_time: bool = False
    hold: int = 5
    faults: tuple[str, ...] = ()
    record: Path | None = None
    replay: Path | None = None
    certificates: "Certificates | None" = None

    def __post_init__(self) -> None:
        """Check the types of values."""
        check_fields(self, "LinkOptions: ")
        if isinstance(self.faults, str):  # which is a sequence, too: of letters
            raise UsageError(
                f"LinkOptions: faults={self.faults!r}: is one text, expected a sequence of texts; "
                f"cure: faults=({self.faults!r},)"
            )
        if not isinstance(self.faults, Sequence) or not all(
            isinstance(one, str) for one in self.faults
        ):
            raise UsageError(
                f"LinkOptions: faults={self.faults!r}: expected a sequence of texts; "
                "cure: leave it out, or faults=('cut@20',)"
            )
        object.__setattr__(self, "faults", tuple(self.faults))
        self._check_certificates()
        if self.hold < 0:
            raise UsageError(f"LinkOptions: hold={self.hold}: must be 0 or more")
        for name in ("record", "replay"):
            path = getattr(self, name)
            if isinstance(path, str):
                object.__setattr__(self, name, Path(path))
            if not isinstance(path, str | Path | None) or "\0" in str(path):
                raise UsageError(
                    f"LinkOptions: {name}={path!r}: expected a path; cure: name a file"
                )

    def _check_certificates(self) -> None:
        if self.certificates is None:
            return
        from spikeport.backends.board.address import Certificates

        if not isinstance(self.certificates, Certificates):
            raise UsageError(
                f"LinkOptions: certificates={self.certificates!r}: expected Certificates; "
                "cure: Certificates(certificate, key, authority) of "
                "spikeport.backends.board.address"
            )

    def idle(self, backend: str) -> tuple[str, ...]:
        """Return the names of the fields that differ from their defaults, and do nothing."""
        names = {one.name for one in fields(self)}
        used = {"board": names - {"replay"}, "replay": {"replay"}}.get(backend, set())
        return tuple(
            one.name
            for one in fields(self)
            if one.name not in used and getattr(self, one.name) != one.default
        )


OWN_STUB = LinkOptions()
"""The default link: a stub, in simulated time."""


def record_of(link: LinkOptions) -> Path:
    """Return the record that is played back; UsageError if none is named."""
    if link.replay is None:
        raise UsageError("backend 'replay' plays a record back: name it, --replay FILE")
    return link.replay
