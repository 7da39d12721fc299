"""The page of a run under way, served on loopback until the run ends."""

import math
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from spikeport.experiments import watching
from spikeport.experiments.run_folder import REQUEST, SO_FAR
from spikeport.experiments.viewer.page import content, page
from spikeport.reading.hdf5 import read_dataset
from spikeport.reading.mismatch import MismatchError

EMPTY = '{"rows":[],"end_s":0}'
"""The content of a page before the run's first step."""
LOOKED_S = 3.0
"""The run is left alone when no page has asked for this long."""
WAIT_S = 1.0
"""Longest wait for an answer, before a check that the run still goes on."""
REST = 4
"""After an answer, the run is left alone for this many times as long as the answer took."""
IDLE_S = 0.2
"""Time between two looks at page and run."""
LAST_S = 5.0
"""Time that a page has to fetch the end of a run."""


class Live:
    """The content of pages: of the run so far, and at the end of the whole run.

    Attributes
    ----------
    url : str
        Address of the page. Part of it is secret: other users of the machine, and other pages in
        the browser, do not know it.
    data : str or None
        Content of the page; None before the run's first answer.
    over : bool
        True once the run is over.
    """

    def __init__(self, title: str) -> None:
        self.data: str | None = None
        self.over = False
        self._title = title
        self._looked_s = -math.inf
        self._fetched = threading.Event()
        self._path = f"/{secrets.token_urlsafe(16)}/"
        self.url = ""

    @property
    def is_watched(self) -> bool:
        """True if a page has asked lately."""
        return time.monotonic() - self._looked_s < LOOKED_S

    def end(self, data: str) -> None:
        """Let pages fetch the end of the run, and wait a moment for them."""
        self.data, self.over = data, True
        if self.is_watched:
            self._fetched.wait(LAST_S)

    @contextmanager
    def served(self) -> Iterator[None]:
        """Serve the page on a free port of loopback."""
        live = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                live._reply(self)

            def log_message(self, *_arguments: object) -> None:
                """Do not print requests."""

        with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
            self.url = f"http://127.0.0.1:{server.server_port}{self._path}"
            threading.Thread(target=server.serve_forever, daemon=True).start()
            try:
                yield
            finally:
                server.shutdown()

    def _reply(self, request: BaseHTTPRequestHandler) -> None:
        if request.path == self._path:
            _send(request, page(self.data or EMPTY, self._title, live=True), "text/html")
        elif request.path == f"{self._path}data":
            self._looked_s, over = time.monotonic(), self.over
            _send(request, self.data, "application/json", "over" if over else "on")
            if over:
                self._fetched.set()
        else:
            request.send_error(HTTPStatus.NOT_FOUND)


def _send(
    request: BaseHTTPRequestHandler, text: str | None, kind: str, state: str | None = None
) -> None:
    """Send a text; without one, an empty answer."""
    body = (text or "").encode(errors="backslashreplace")
    request.send_response(HTTPStatus.NO_CONTENT if text is None else HTTPStatus.OK)
    request.send_header("Content-Type", f"{kind}; charset=utf-8")
    if state is not None:
        request.send_header("X-Run", state)
    # A browser that reloads, or leaves, does not wait for the rest.
    with suppress(ConnectionError):
        request.end_headers()
        request.wfile.write(body)


def watch(folder: Path, title: str, announce: Callable[[str], None]) -> bool:
    """Serve the page of the run in a folder until it ends; ``announce`` takes the address.

    Return whether the run has written a result: an earlier run's may be left in the folder.
    """
    live, result = Live(title), folder / "result.json"
    before = _written_at(result)
    with live.served():
        announce(live.url)
        try:
            while watching.is_running(folder):
                begin = time.monotonic()
                if live.is_watched and watching.ask(folder, WAIT_S):
                    # A run that ends may remove its answer while it is read.
                    with suppress(MismatchError, OSError):
                        live.data = content(read_dataset(folder / SO_FAR))
                    time.sleep(REST * (time.monotonic() - begin))
                time.sleep(IDLE_S)
        finally:  # a run that ended meanwhile has not removed the last request
            (folder / REQUEST).unlink(missing_ok=True)
        is_whole = _written_at(result) not in (before, None)
        if is_whole:
            live.end(content(read_dataset(folder / "probes.nc")))
        return is_whole


def _written_at(path: Path) -> int | None:
    """Return the time at which a file was written, in ns; None if there is no file."""
    with suppress(OSError):
        return path.stat().st_mtime_ns
    return None
