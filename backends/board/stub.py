"""A stub of a board: a server that is started for one session, and ended with it."""

import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path

from spikeport.backends.board.address import Address
from spikeport.child import START_S, Child
from spikeport.errors import UsageError

WARNING = "warning: "
"""The beginning of a line in which spikeport's command line prints a warning."""


class Stub:
    """A board server on a Unix socket in a folder of its own.

    Parameters
    ----------
    faults : sequence of str
        A plan of faults, see `spikeport.backends.board.faults`.

    Attributes
    ----------
    address : Address
        The address that it listens at.

    Raises
    ------
    UsageError
        If the path of the temporary folder is too long for a socket.
    BackendError
        If it does not start; the message has its output.
    """

    def __init__(self, faults: Sequence[str] = ()) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="spikeport-board-")
        options = [part for fault in faults for part in ("--fault", fault)]
        try:
            self.address = self._address()
            listen = ["--listen", str(self.address), "--once", "--idle", str(START_S)]
            self._child = Child("board", ["board", "serve", *listen, *options])
        except BaseException:
            self._folder.cleanup()
            raise

    def _address(self) -> Address:
        try:
            return Address.parse(f"unix:{Path(self._folder.name) / 'socket'}")
        except UsageError as error:
            raise UsageError(f"the board's stub: {error}, as by TMPDIR=/tmp") from None

    @property
    def process_id(self) -> int:
        """The number of the server's process."""
        return self._child.process_id

    def close(self) -> None:
        """Wait until the server ends after its one session, or end it; pass its warnings on."""
        words = self._child.close()
        self._folder.cleanup()
        for line in words.splitlines():
            if line.startswith(WARNING):
                warnings.warn(f"on the board: {line.removeprefix(WARNING)}", stacklevel=2)
