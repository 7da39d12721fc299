"""A board of one's own: a server that is started for one session, and ended with it."""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from threading import Timer

from spikeport.backends.board.address import Address
from spikeport.errors import BackendError

START_S = 60.0
STOP_S = 10.0


class Stub:
    """A board server on a Unix socket in a folder of its own.

    Parameters
    ----------
    faults : sequence of str
        A plan of faults, see `spikeport.backends.board.faults`.

    Attributes
    ----------
    address : Address
        Where it listens.

    Raises
    ------
    BackendError
        If it does not start; has its last words.
    """

    def __init__(self, faults: Sequence[str] = ()) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="spikeport-board-")
        self.address = Address.parse(f"unix:{Path(self._folder.name) / 'socket'}")
        options = [part for fault in faults for part in ("--fault", fault)]
        listen = ["--listen", str(self.address), "--once", "--idle", str(START_S)]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "spikeport", "board", "serve", *listen, *options],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._await_start()

    @property
    def process_id(self) -> int:
        """The number of the server's process."""
        return self._process.pid

    def _await_start(self) -> None:
        """Wait for its first line, which it prints once it listens."""
        assert self._process.stdout is not None
        timer = Timer(START_S, self._process.kill)
        timer.start()
        line = self._process.stdout.readline()
        timer.cancel()
        if not line.startswith("board:"):
            self.close()
            raise BackendError(f"the board's server did not start: {line.strip() or 'no word'}")

    def close(self) -> None:
        """Wait for its end, which its one session brings, or end it."""
        try:
            self._process.communicate(timeout=STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
        self._folder.cleanup()
