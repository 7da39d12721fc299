"""A child process of our own command line, which serves its parent."""

import contextlib
import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Sequence
from threading import Thread

from spikeport.errors import BackendError
from spikeport.pacing import later

# Imports take seconds, compiling kernels takes 10 s, and other work may share the machine.
START_S = 60.0
STOP_S = 10.0
LINES_KEPT = 100
"""The last lines of output that are kept, for errors, warnings and a robot's summary."""


class Child:
    """A server that was started for one session.

    Parameters
    ----------
    name : str
        The server's name in messages. Once it serves, it prints a line that begins with ``NAME:``.
    arguments : sequence of str
        The arguments of ``spikeport``.

    Raises
    ------
    BackendError
        If it does not start; the message has its output.
    """

    def __init__(self, name: str, arguments: Sequence[str]) -> None:
        self._process = subprocess.Popen(
            # Without the current folder, where a file may have the name of one of Python's modules.
            [sys.executable, "-P", "-m", "spikeport", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            # An error is the last line of its output.
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",  # or an odd byte would end the reader
            # Ctrl-C and the end of a terminal reach this process alone, which ends the child.
            start_new_session=True,
        )
        try:
            self._await_start(name)
        except BaseException:  # also an interrupt: nobody else could end it
            with self._process:
                self._kill()
            raise
        # Read all the time: a child whose pipe is full would wait for ever.
        self._lines: deque[str] = deque(maxlen=LINES_KEPT)
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        self._lines.extend(self._process.stdout)

    @property
    def process_id(self) -> int:
        """The ID of its process."""
        return self._process.pid

    @property
    def runs(self) -> bool:
        """True until its process ends."""
        return self._process.poll() is None

    def _await_start(self, name: str) -> None:
        """Wait for the line that says that it serves; libraries may print warnings before it."""
        assert self._process.stdout is not None
        before: deque[str] = deque(maxlen=LINES_KEPT)
        # Reading has no limit of its own.
        with later(START_S, self._kill):
            for line in self._process.stdout:
                if line.startswith(f"{name}:"):
                    return
                before.append(line)
        said = "".join(before).strip() or "no word"
        raise BackendError(f"the {name}'s server did not start: {said}")

    def close(self) -> str:
        """Wait until it ends after its one session, or kill it; return its last output.

        Without output, return how it ended.
        """
        with self._process:  # which waits for a killed one, and closes its output
            try:
                self._process.wait(STOP_S)
            except BaseException as error:
                self._kill()
                # An interrupt ends it as well: nobody else could.
                if not isinstance(error, subprocess.TimeoutExpired):
                    raise
            finally:
                self._reader.join()
        return "".join(self._lines).strip() or self._ending()

    def _kill(self) -> None:
        """Kill its process, and those that it started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)

    def _ending(self) -> str:
        code = self._process.returncode
        return f"exit code {code}" if code >= 0 else f"killed by {signal.Signals(-code).name}"
