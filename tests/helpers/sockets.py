"""Sockets that processes of this machine listen on, read from /proc."""

import contextlib
import os
import re
from collections.abc import Iterator
from pathlib import Path

LISTENING = "0A"
ACCEPTING = 0x10000


def family(process: int) -> list[int]:
    """Return a process and all of its descendants."""
    found = [process]
    for children in Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in children.read_text().split():
                found += family(int(child))
    return found


def listening(processes: list[int]) -> list[str]:
    """Return the rows of /proc/net of sockets that these processes listen on, of any kind."""
    held = {inode for process in processes for inode in _sockets(process)}
    return [row for inode, row in _listening() if inode in held]


def _sockets(process: int) -> Iterator[str]:
    for entry in Path(f"/proc/{process}/fd").iterdir():
        with contextlib.suppress(OSError):
            if found := re.fullmatch(r"socket:\[(\d+)\]", os.readlink(entry)):
                yield found[1]


def _listening() -> Iterator[tuple[str, str]]:
    for name in ("tcp", "tcp6", "udp", "udp6"):
        for row in Path(f"/proc/net/{name}").read_text().splitlines()[1:]:
            columns = row.split()
            if columns[3] == LISTENING or name.startswith("udp"):
                yield columns[9], row
    for row in Path("/proc/net/unix").read_text().splitlines()[1:]:
        columns = row.split()
        if int(columns[3], 16) & ACCEPTING:
            yield columns[6], row
