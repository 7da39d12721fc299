"""Pages in headless Chromium, which must fetch nothing and print no messages."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@contextmanager
def browser() -> Iterator[Any]:
    """Yield a browser, or skip the test."""
    if CHROMIUM is None:
        pytest.skip("opens pages in a browser: apt-get install chromium")
    api = pytest.importorskip("playwright.sync_api")
    with (
        api.sync_playwright() as playwright,
        playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-dev-shm-usage"]
        ) as opened,
    ):
        yield opened


@contextmanager
def tab_of(browser: Any, page: Path) -> Iterator[Any]:
    """Yield a page in a browser; refuse messages, and requests other than for the file."""
    events: list[str] = []
    tab = browser.new_page(viewport={"width": 1000, "height": 800})
    tab.on("console", lambda message: events.append(message.text))
    tab.on("pageerror", lambda error: events.append(str(error)))
    tab.on("request", lambda request: events.append(request.url))
    tab.goto(page.as_uri())
    yield tab
    assert [url for url in events if not url.startswith("data:")] == [page.as_uri()]
    tab.close()
