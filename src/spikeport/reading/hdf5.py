"""Untrusted HDF5 files, read as plain values or as time series; no other file is read.

An HDF5 file can link to other files, store its data in them, and ask for filter libraries: h5py
would load all of these. Sizes are checked before anything is inflated. On a damaged file the HDF5
library may loop for ever, or end its process: so a child process of limited time and memory reads.
"""

import contextlib
import io
import math
import multiprocessing
import resource
import warnings
from collections.abc import Callable, Iterator
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np

from spikeport.extras import missing
from spikeport.reading.archive import FILE_BYTES, read_bytes
from spikeport.reading.mismatch import MismatchError, first_line

if TYPE_CHECKING:
    import xarray as xr

T = TypeVar("T")
Value: TypeAlias = np.ndarray | str | list[str] | dict[str, "Value"]

MOST_LEVELS = 32
"""Most levels of groups within groups: a nested NIR graph takes two."""
MOST_OBJECTS = 2**16
"""Most groups and arrays: enough for ten thousand nodes."""
TEXT_BYTES = 2**22
"""Most bytes of all texts together: they name edges."""
MOST_TEXTS = 40_000
"""Most texts in an array: two for each of 20,000 edges, which take seconds to read one by one."""
CPU_S = 6
"""The CPU time that reading may take: the largest file that is allowed takes two to four."""
MEMORY_BYTES = 2**30
"""The memory that reading may take, beyond the process's memory at its start."""
CONTEXT = multiprocessing.get_context("fork")
METADATA = "metadata"
"""A group that may hold anything, and does not affect what a NIR graph computes."""

OPENED_WITH = ("h5netcdf.legacyapi", "dask.array")
"""Modules that xarray imports as it opens a file; Dask only if it is installed."""

DAMAGES = (
    OSError,
    KeyError,
    RuntimeError,
    ValueError,
    TypeError,
    AttributeError,
    OverflowError,
    IndexError,
)
"""Errors that h5py raises for a damaged file."""

FILTERS = (1, 2, 3, 32000)
"""Deflate, shuffle, check sums and LZF, by HDF5's numbers: h5py writes and ships these filters."""


def read(path: Path) -> dict[str, Value]:
    """Return groups, numbers and texts of a file, group by group.

    Raises
    ------
    MismatchError
        If it is not HDF5, damaged, too large, or holds anything but numbers, texts and groups.
    MissingExtraError
        If h5py is absent.
    """
    _h5py("reading a NIR graph", "nir")
    return _in_a_child(_values, read_bytes(path))


def read_dataset(path: Path) -> "xr.Dataset":
    """Return the time series of a netCDF file of a run.

    Raises
    ------
    MismatchError
        If it is not netCDF, damaged, too large, or has data in other files.
    MissingExtraError
        If h5py is absent.
    """
    _h5py("reading time series", "runs")
    _import_once()
    return _in_a_child(_dataset, read_bytes(path))


def _import_once() -> None:
    """Import what opening a file imports, so that no child spends a second on it."""
    import xarray  # noqa: F401

    for name in OPENED_WITH:
        with contextlib.suppress(ModuleNotFoundError):
            import_module(name)


def _in_a_child(function: Callable[[bytes], T], content: bytes) -> T:
    """Return a function's result for a file, from a child of limited CPU time and memory."""
    receiver, sender = CONTEXT.Pipe(duplex=False)
    child = CONTEXT.Process(target=_send, args=(sender, function, content), daemon=True)
    with warnings.catch_warnings(action="ignore"):  # about threads, which the child does not use
        child.start()
    sender.close()
    try:
        found, refusal = receiver.recv()
    except (EOFError, OSError):  # it ended before it sent, or as it did
        raise MismatchError(
            "a whole HDF5 file", "a file on which the HDF5 library failed"
        ) from None
    finally:
        child.join()
        receiver.close()
    if refusal is not None:
        raise MismatchError(*refusal)
    result: T = found
    return result


def _send(sender: Connection, function: Callable[[bytes], object], content: bytes) -> None:
    """Send a function's result for a file, or its refusal, within limits of time and memory."""
    _limit(resource.RLIMIT_CPU, CPU_S)
    _limit(resource.RLIMIT_CORE, 0)
    with contextlib.suppress(OSError):  # a system without /proc
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        _limit(resource.RLIMIT_AS, pages * resource.getpagesize() + MEMORY_BYTES)
    try:
        sender.send((function(content), None))
    except MismatchError as error:
        sender.send((None, (error.expected, error.found, error.cure)))
    except MemoryError:
        wanted = f"a file that takes at most {MEMORY_BYTES:,} bytes of memory"
        sender.send((None, (wanted, "one that takes more")))


def _limit(kind: int, most: int) -> None:
    """Limit a resource of this process, which may have a lower limit already."""
    _, hard = resource.getrlimit(kind)
    most = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(kind, (most, most))


def _values(content: bytes) -> dict[str, Value]:
    """Return the content of a NIR graph, without its metadata."""
    return _walked(content, left_out=METADATA)


def _walked(content: bytes, left_out: str | None = None) -> dict[str, Value]:
    """Return the whole content of a file, except for members called ``left_out``."""
    import h5py

    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            return _Reader(h5py, left_out).group(file, depth=0)
    except DAMAGES as error:
        raise MismatchError("a whole HDF5 file", first_line(error)) from error


def _dataset(content: bytes) -> "xr.Dataset":
    import xarray as xr

    _walked(content)  # checks sizes, links and filters of everything that is loaded below
    try:
        # Raw values: scaled values and dates could take many times the bytes.
        with xr.open_dataset(
            io.BytesIO(content), engine="h5netcdf", mask_and_scale=False, decode_times=False
        ) as dataset:
            return dataset.load()
    except MemoryError:
        raise
    except Exception as error:  # the readers of netCDF raise anything for a damaged file
        raise MismatchError("time series in netCDF", first_line(error)) from error


def _h5py(use: str, extra: str) -> None:
    """Import h5py once, for all children; MissingExtraError if it is absent."""
    try:
        import_module("h5py")
    except ModuleNotFoundError as error:
        raise missing(use, "h5py", extra) from error


class _Reader:
    """A reader of one file, with the numbers of bytes, objects and letters that it may yet read."""

    def __init__(self, h5py: ModuleType, left_out: str | None) -> None:
        self._h5py, self._left_out = h5py, left_out
        self._bytes, self._objects, self._text = FILE_BYTES, MOST_OBJECTS, TEXT_BYTES

    def group(self, group: Any, depth: int) -> dict[str, Value]:
        if depth > MOST_LEVELS:
            raise MismatchError(f"at most {MOST_LEVELS} levels of groups", "more")
        for name in group:
            self._check_link(group, name)
        # NIR keeps metadata beside a node's type; elsewhere, the name is that of a node.
        left_out = self._left_out if "type" in group else None
        names = (name for name in group if name != left_out)
        return {name: self._member(group[name], name, depth) for name in names}

    def _check_link(self, group: Any, name: str) -> None:
        self._objects -= 1
        if self._objects < 0:
            raise MismatchError(f"at most {MOST_OBJECTS:,} groups and arrays", "more")
        link = group.get(name, getlink=True)
        if not isinstance(link, self._h5py.HardLink):
            raise MismatchError(f"{name} in the file itself", "a link")

    def _member(self, item: Any, name: str, depth: int) -> Value:
        if isinstance(item, self._h5py.Group):
            return self.group(item, depth + 1)
        if not isinstance(item, self._h5py.Dataset):
            raise MismatchError(f"a group or an array {name}", type(item).__name__)
        return self._array(item, name)

    def _array(self, item: Any, name: str) -> Value:
        if item.external or item.is_virtual:
            raise MismatchError(f"{name} in the file itself", "data in another file")
        filters = item.id.get_create_plist()
        if any(filters.get_filter(i)[0] not in FILTERS for i in range(filters.get_nfilters())):
            raise MismatchError(f"{name} uncompressed, deflated or in LZF", "another filter")
        # a chunk is inflated whole, even to read a part of it
        chunk = math.prod(item.chunks or ()) * item.dtype.itemsize
        if chunk > FILE_BYTES:
            raise MismatchError(f"chunks of at most {FILE_BYTES:,} bytes in {name}", f"{chunk:,}")
        if self._h5py.check_string_dtype(item.dtype) is not None:
            return self._texts(item, name)
        if item.dtype.kind not in "biuf":
            raise MismatchError(f"numbers or texts in {name}", f"type {item.dtype}")
        self._bytes -= int(item.size or 0) * item.dtype.itemsize
        if item.shape is None or self._bytes < 0:
            raise MismatchError(f"arrays of at most {FILE_BYTES:,} bytes", f"more in {name}")
        return np.asarray(item[()])

    def _texts(self, item: Any, name: str) -> str | list[str]:
        """Return texts, read one by one, since their sizes are not known in advance."""
        if item.dtype.itemsize > TEXT_BYTES:
            found = f"texts of {item.dtype.itemsize:,} bytes"
            raise MismatchError(f"at most {TEXT_BYTES:,} bytes of texts in {name}", found)
        if item.shape is None or item.size > MOST_TEXTS:
            raise MismatchError(f"at most {MOST_TEXTS:,} texts in {name}", f"{item.size}")
        texts = [self._text_of(one, name) for one in self._rows(item)]
        return texts if item.shape else texts[0]

    def _rows(self, item: Any) -> Iterator[bytes | str]:
        if not item.shape:
            yield item[()]
        for index in np.ndindex(item.shape if item.shape else (0,)):
            yield item[index]

    def _text_of(self, value: bytes | str, name: str) -> str:
        self._text -= len(value)
        if self._text < 0:
            raise MismatchError(f"texts of at most {TEXT_BYTES:,} bytes", f"more in {name}")
        try:
            return value.decode() if isinstance(value, bytes) else value
        except UnicodeDecodeError as error:
            raise MismatchError(f"a text in {name}", str(error)) from error
