"""Python's audit events while a function runs: calls that could do harm."""

import os
import sys
from collections.abc import Callable
from typing import Any

WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
HARMFUL = (
    "pickle.",
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "os.remove",
    "os.rename",
    "subprocess.",
)
_seen: list[str] | None = None


def _heard(event: str, arguments: tuple[Any, ...]) -> None:
    if _seen is None:
        return
    if event.startswith(HARMFUL):
        _seen.append(event)
    if event == "open" and isinstance(arguments[2], int) and arguments[2] & WRITING:
        _seen.append(f"writing {arguments[0]}")


sys.addaudithook(_heard)  # stays until the end of the process, and acts only in `harm_of`


def harm_of(function: Callable[[], object]) -> list[str]:
    """Call a function, and return its events that could do harm."""
    global _seen
    _seen = []
    try:
        function()
    finally:
        harm, _seen = _seen, None
    return harm
