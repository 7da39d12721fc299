"""Event files of cameras (DVS), whose events become the spikes of an input, step by step.

    source = (y // pool_y) s_y + (x // pool_x) s_x + polarity s_p
    step = 1 + floor((t - t_start) / dt)

The strides s and the file formats are those of nengo-loihi's `DVSFileChipProcess`. Its own reader
neither limits nor checks its input, and needs NumPy 1. It sends all events before ``t_start`` in
the first step; here they are left out, as in float Nengo.
"""

import contextlib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from nengo_loihi.dvs import DVSFileChipProcess

from spikeport.compile.loihi.replaced import replaced
from spikeport.errors import UsageError, printable
from spikeport.reading.archive import read_bytes
from spikeport.reading.mismatch import MismatchError

FILE_BYTES = 2**26
"""Largest file: 8 million events, some ten seconds of a busy camera; reading them takes 0.7 GB."""
HEADER_BYTES = 2**16
"""Longest header of an AEDAT file; the headers of cameras have a few lines of text."""
US_PER_S = 1e6
FORMATS = ("aedat", "events")
EVENTS = np.dtype([("y", "<u2"), ("x", "<u2"), ("t_us", "<u4")])
"""An event in an ``.events`` file: x begins at bit 1, y at bit 2; bit 1 of y is the polarity."""
AEDAT = np.dtype([("address", ">u4"), ("t_us", ">u4")])
"""An event in an ``.aedat`` file of version 2.0. Source: inivation's documentation of AEDAT."""


class Events(NamedTuple):
    """The events of a file, in the order of time; arrays of (n,).

    Attributes
    ----------
    t_us : array
        The time, in microseconds.
    y, x : array
        The row and column of the pixel.
    polarity : array
        1 where the pixel became brighter, 0 where it became darker.
    """

    t_us: np.ndarray
    y: np.ndarray
    x: np.ndarray
    polarity: np.ndarray


class EventSteps(NamedTuple):
    """The spikes of an input in the order of time: step, from 1, and source; arrays of (n,)."""

    step: np.ndarray
    source: np.ndarray

    def at(self, step: int) -> np.ndarray:
        """Return the sources that spike in a step, each as often as it has events in the step."""
        first, end = np.searchsorted(self.step, (step, step + 1))
        return self.source[first:end]


def event_steps(process: DVSFileChipProcess, dt_s: float) -> EventSteps:
    """Read the file of a process, and return its events as spikes in steps of ``dt_s`` seconds.

    Raises
    ------
    UsageError
        If the file cannot be read, is of another format, too large, or has pixels that its camera
        lacks; the message gives path and reason.
    """
    t_us, source = read_sources(process)
    since_us = t_us - process.t_start * US_PER_S
    begun = since_us >= 0
    step = np.floor(since_us[begun] / _step_us(dt_s)).astype(np.int64) + 1
    return EventSteps(step, source[begun])


def _step_us(dt_s: float) -> float:
    """Return the length of a step in microseconds, as an exact integer where it is meant as one."""
    step_us = dt_s * US_PER_S
    whole = round(step_us)
    return whole if math.isclose(step_us, whole, rel_tol=1e-12) else step_us


def read_sources(process: DVSFileChipProcess) -> tuple[np.ndarray, np.ndarray]:
    """Return time in microseconds and source of each event, (n,) both; see `event_steps`."""
    path = Path(process.file_path)
    try:
        events = _read(path, process.file_fmt, process.rel_time)
        _check_pixels(events, process)
    except MismatchError as error:
        raise UsageError(printable(f"{path}: not a file of events: {error}")) from None
    across, down = process.polarity, process.polarity * process.width
    of_polarity = 1
    if not process.channels_last:
        across, down, of_polarity = 1, process.width, process.width * process.height
    rows, columns = events.y // process.pool[0], events.x // process.pool[1]
    return events.t_us, rows * down + columns * across + events.polarity * of_polarity


@contextlib.contextmanager
def own_event_reader() -> Iterator[None]:
    """Let float Nengo read the files of nengo-loihi's processes with `read_sources`."""
    with replaced(DVSFileChipProcess, "_read_events", read_sources):
        yield


def _read(path: Path, kind: str | None, relative: bool | None) -> Events:
    """Read a file; its suffix is the default ``kind``. Relative times start at the first event."""
    kind = kind or path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise MismatchError(f"file_fmt or suffix {' or '.join(FORMATS)}", kind or "none")
    content = read_bytes(path, FILE_BYTES)
    events = _from_aedat(content) if kind == "aedat" else _from_events(content)
    # Sorted, as `at` searches by bisection; stable, so that simultaneous events keep their order.
    order = np.argsort(events.t_us, kind="stable")
    events = Events(*(array[order] for array in events))
    if len(events.t_us) and (kind == "aedat" if relative is None else relative):
        events = events._replace(t_us=events.t_us - events.t_us[0])
    return events


def _from_events(content: bytes) -> Events:
    table = _table(content, EVENTS)
    y, x = table["y"].astype(np.int64), table["x"].astype(np.int64)
    # Bit 0 of x and of y is not part of the event: see `EVENTS`.
    return Events(table["t_us"].astype(np.int64), y >> 2, x >> 1, y >> 1 & 1)


def _from_aedat(content: bytes) -> Events:
    table = _table(content[_header_length(content) :], AEDAT)
    address = table["address"].astype(np.int64)
    # {.. 1, y 9, x 10, polarity 1, .. 11}, the layout of a DAVIS camera.
    y, x = address >> 22 & 0x1FF, address >> 12 & 0x3FF
    return Events(table["t_us"].astype(np.int64), y, x, address >> 11 & 1)


def _header_length(content: bytes) -> int:
    """Return the length of an AEDAT file's header, the lines with # at its start, in bytes."""
    first = content[:HEADER_BYTES].split(b"\n", 1)[0].strip()
    if first != b"#!AER-DAT2.0":
        raise MismatchError("#!AER-DAT2.0, the only version that is read", repr(first[:40]))
    length = 0
    while content[length : length + 1] == b"#":
        length = content.find(b"\n", length, HEADER_BYTES) + 1
        if not length:
            raise MismatchError(f"a header of at most {HEADER_BYTES:,} bytes", "a longer one")
    return length


def _table(content: bytes, event: np.dtype[np.void]) -> np.ndarray:
    if rest := len(content) % event.itemsize:
        raise MismatchError(f"events of {event.itemsize} bytes", f"{rest} more bytes at the end")
    return np.frombuffer(content, dtype=event)


def _check_pixels(events: Events, process: DVSFileChipProcess) -> None:
    outside = (events.y >= process.dvs_height) | (events.x >= process.dvs_width)
    if outside.any():
        first = int(np.argmax(outside))
        raise MismatchError(
            f"{process.dvs_height} rows and {process.dvs_width} columns (dvs_height, dvs_width)",
            f"an event in row {events.y[first]}, column {events.x[first]}, counted from 0",
        )
