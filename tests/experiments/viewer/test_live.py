"""The page of a run under way: served to viewers with its address, up to the run's end."""

import contextlib
import json
import socket
import struct
import threading
import urllib.error
import urllib.request

import pytest

from spikeport.experiments import run_folder, watching
from spikeport.experiments.viewer import live
from tests.helpers.browsers import browser


class Watched:
    """A run of a tenth of a second of some series, which a viewer watches."""

    def __init__(self, folder, series):
        self.folder, self.series = folder, series
        self.url, self.ends_whole, self.is_whole = "", True, None
        self._locked, self._announced, self._over = (threading.Event() for _ in range(3))
        self._threads = [threading.Thread(target=one) for one in (self._run, self._view)]

    def _run(self):
        with run_folder.opened(self.folder, "walk", overwrite=True) as folder:
            self._locked.set()
            self._announced.wait(60)
            while not self._over.wait(0.05):
                watching.answer(folder, lambda: self.series.isel(time=slice(20)))
            if self.ends_whole:
                run_folder.write_probes(folder, self.series)
                run_folder.write_result(folder, {})

    def _view(self):
        # The viewer takes the lock to look at it: if it did so first, the run would be refused.
        self._locked.wait(60)
        self.is_whole = live.watch(self.folder, "a <b>run</b> in d\udcff", self._announce)

    def _announce(self, url):
        self.url = url
        self._announced.set()

    @contextlib.contextmanager
    def begun(self):
        for thread in self._threads:
            thread.start()
        self._announced.wait(60)
        try:
            yield
        finally:
            self.end()
            for thread in self._threads:
                thread.join(60)

    def end(self):
        self._over.set()


@pytest.fixture
def watched(series, tmp_path):
    return Watched(tmp_path / "run", series.drop_dims(["step", "gpi_spike"]))


def fetched(url):
    with urllib.request.urlopen(url, timeout=60) as answer:
        return answer.status, answer.headers["X-Run"], answer.read().decode()


def until(url, state):
    """Wait until the viewer reports a state of the run, and return its content."""
    while True:
        status, found, text = fetched(f"{url}data")
        if found == state and status == 200:
            return json.loads(text)


@pytest.mark.slow
def test_a_page_serves_the_series_so_far_and_the_whole_series_at_the_end(watched):
    with watched.begun():
        status, _, page = fetched(watched.url)
        assert status == 200
        assert "connect-src 'self'" in page
        assert "a &lt;b&gt;run&lt;/b&gt; in d\\udcff" in page
        assert until(watched.url, "on")["end_s"] == pytest.approx(0.095)
        watched.end()
        assert until(watched.url, "over")["end_s"] == pytest.approx(0.995)


@pytest.mark.parametrize("ends_whole", [True, False])
def test_a_run_that_wrote_nothing_is_told_from_an_earlier_one(watched, ends_whole):
    watched.ends_whole = ends_whole
    with run_folder.opened(watched.folder, "walk") as folder:
        run_folder.write_result(folder, {})
    with watched.begun():
        pass
    assert watched.is_whole == ends_whole


@pytest.mark.slow
def test_a_browser_that_disconnects_causes_no_error(watched, capsys):
    with watched.begun():
        until(watched.url, "on")
        address, path = watched.url.removeprefix("http://").split("/", 1)
        host, port = address.split(":")
        for _ in range(20):
            with socket.create_connection((host, int(port))) as leaving:
                # Reset the connection while the page, larger than the buffers, is on its way.
                leaving.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                leaving.sendall(f"GET /{path} HTTP/1.0\r\n\r\n".encode())
                leaving.recv(1)
        assert fetched(watched.url)[0] == 200
    assert "Traceback" not in capsys.readouterr().err


def test_other_addresses_than_the_secret_one_are_not_found(watched):
    with watched.begun():
        root = watched.url.rsplit("/", 2)[0]
        assert root.startswith("http://127.0.0.1:")
        for path in ("/", "/data", "/live/data"):
            with pytest.raises(urllib.error.HTTPError, match="404"):
                fetched(root + path)


@pytest.mark.slow
def test_a_browser_follows_a_run(watched):
    with browser() as opened, watched.begun():
        tab, said = opened.new_page(), []
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.goto(watched.url)
        tab.locator("#live", has_text="live").wait_for()
        assert tab.evaluate("now === run.end_s && run.end_s < 0.1")
        watched.end()
        tab.locator("#live", has_text="the run is over").wait_for()
        assert tab.evaluate("now === run.end_s && run.end_s > 0.9")
        assert tab.locator("figure").count() == len(tab.evaluate("run.rows"))
        assert tab.locator("#robot").is_visible()
        assert said == []
