"""HDF5 files of others as plain values: groups, numbers and texts, and nothing that they point to.

HDF5 can link to other files, take its data out of them, and ask for libraries that undo a filter:
h5py would follow. Sizes are checked before anything is inflated.
"""

import io
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from spikeport.errors import MissingExtraError
from spikeport.reading.archive import FILE_BYTES, read_bytes
from spikeport.reading.mismatch import MismatchError

Value: TypeAlias = np.ndarray | str | list[str] | dict[str, "Value"]

DEPTH = 32
"""Groups within groups: a nested graph takes two."""
OBJECTS = 2**16
"""Groups and arrays: ten thousand nodes."""
TEXT_BYTES = 2**22
"""Of all texts: names of edges."""
SKIPPED = "metadata"
"""A group that says nothing of what a graph computes."""

DAMAGES = (
    OSError,
    KeyError,
    RuntimeError,
    ValueError,
    TypeError,
    AttributeError,
    MemoryError,
    OverflowError,
    IndexError,
)
"""What h5py raises of a damaged file."""

FILTERS = (1, 2, 3, 32000)
"""Deflate, shuffle, check sums and LZF, by HDF5's numbers: what h5py writes, and brings itself."""


def read(path: Path) -> dict[str, Value]:
    """Return what is in a file, group by group.

    Raises
    ------
    MismatchError
        It is no such file, damaged, too large, or holds more than numbers, texts and groups.
    MissingExtraError
        h5py is absent.
    """
    h5py = _h5py()
    content = read_bytes(path)
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            return _Reader(h5py).group(file, depth=0)
    except DAMAGES as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise MismatchError("a whole HDF5 file", reason) from error


def _h5py() -> ModuleType:
    try:
        return import_module("h5py")
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            "reading a NIR graph needs the package h5py, which is not installed; install it with: "
            "pip install 'spikeport[nir]'"
        ) from error


class _Reader:
    """What reading a file may still take."""

    def __init__(self, h5py: ModuleType) -> None:
        self._h5py = h5py
        self._bytes, self._objects, self._text = FILE_BYTES, OBJECTS, TEXT_BYTES

    def group(self, group: Any, depth: int) -> dict[str, Value]:
        if depth > DEPTH:
            raise MismatchError(f"groups {DEPTH} deep", "deeper ones")
        return {name: self._member(group, name, depth) for name in group if name != SKIPPED}

    def _member(self, group: Any, name: str, depth: int) -> Value:
        self._objects -= 1
        if self._objects < 0:
            raise MismatchError(f"at most {OBJECTS:,} groups and arrays", "more")
        link = group.get(name, getlink=True)
        if not isinstance(link, self._h5py.HardLink):
            raise MismatchError(f"{name} in the file itself", "a link")
        item = group[name]
        if isinstance(item, self._h5py.Group):
            return self.group(item, depth + 1)
        if not isinstance(item, self._h5py.Dataset):
            raise MismatchError(f"a group or an array {name}", type(item).__name__)
        return self._array(item, name)

    def _array(self, item: Any, name: str) -> Value:
        if item.external or item.is_virtual:
            raise MismatchError(f"{name} in the file itself", "data out of another")
        filters = item.id.get_create_plist()
        if any(filters.get_filter(i)[0] not in FILTERS for i in range(filters.get_nfilters())):
            raise MismatchError(f"{name} deflated, or as it is", "another filter")
        if self._h5py.check_string_dtype(item.dtype) is not None:
            return self._texts(item, name)
        if item.dtype.kind not in "biuf":
            raise MismatchError(f"numbers or texts in {name}", f"type {item.dtype}")
        self._bytes -= int(item.size or 0) * item.dtype.itemsize
        if item.shape is None or self._bytes < 0:
            raise MismatchError(f"arrays of at most {FILE_BYTES:,} bytes", f"more in {name}")
        return np.asarray(item[()])

    def _texts(self, item: Any, name: str) -> str | list[str]:
        """Return texts one after the other, since their sizes are not known before."""
        if item.shape is None or item.size > TEXT_BYTES:
            raise MismatchError(f"texts in {name}", f"{item.size} of them")
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
