"""The places of pickles and numbers in torch's files, which may be zip archives or older."""

import io
from collections.abc import Mapping

from spikeport.networks.loading import pickles
from spikeport.networks.loading.pickles import Names
from spikeport.networks.loading.tensors import Order, Storage, plain_name, storages
from spikeport.reading.archive import Archive
from spikeport.reading.mismatch import MismatchError

PICKLE_BYTES = 2**24
"""The largest pickle: it describes tensors in some 100 bytes each, without their numbers."""

ORDERS: Mapping[bytes, Order] = {b"little": "<", b"big": ">"}
DATA = "data.pkl"

MAGIC = 0x1950A86A20F9469CFC6C
"""The number, as a pickle, at the start of a torch file from before zip archives."""

COUNT_BYTES = 8
"""Bytes of the count before the numbers of a storage in such a file."""


def folder_of(archive: Archive, kind: str) -> str:
    """Return the folder that contains all of an archive, with a slash at its end."""
    found = [name.removesuffix(DATA) for name in archive.names if name.endswith(f"/{DATA}")]
    if len(found) != 1 or found[0].count("/") != 1:
        raise MismatchError(kind, f"an archive with {len(found)} {DATA} in a folder")
    return found[0]


def pickled(archive: Archive, folder: str, name: str, names: Names = plain_name) -> object:
    """Return the value of a pickle whose storages are in the folder of its name."""

    def content(key: str, size: int) -> bytes:
        return archive.read(f"{folder}{name}/{key}", size)

    stream = io.BytesIO(archive.read(f"{folder}{name}.pkl", PICKLE_BYTES))
    return pickles.load(stream, names, storages(content, _order(archive, folder)))


def _order(archive: Archive, folder: str) -> Order:
    """Return NumPy's character for the byte order; old files do not state it, and are little."""
    name = f"{folder}byteorder"
    written = archive.read(name, 16) if name in archive.names else b"little"
    if written not in ORDERS:
        raise MismatchError("the order of bytes, little or big", repr(written))
    return ORDERS[written]


def pickled_in_a_row(written: bytes) -> object:
    """Return the content of a file from before zip archives.

    Pickles follow each other: a magic number, a version, the writer's system, the content, and the
    keys of its storages. The storages come last, in the order of the keys.
    """
    stream, by_key = io.BytesIO(written), dict[str, Storage]()
    places: dict[str, int] = {}

    def content(key: str, size: int) -> memoryview:
        if key not in places:
            raise MismatchError(f"a storage {key}", "none")
        # a view: thousands of small tensors may lie in one large storage
        return memoryview(written)[places[key] : places[key] + size]

    make = storages(content)

    def storage(identifier: object) -> Storage:
        found = make(identifier)
        by_key[found.key] = found
        return found

    magic, _, system, value, keys = (pickles.load(stream, plain_name, storage) for _ in range(5))
    if magic != MAGIC or not isinstance(system, dict) or not isinstance(keys, list):
        raise MismatchError("a checkpoint of torch", "other pickles")
    if not system.get("little_endian"):
        raise MismatchError("little-endian numbers", "another order of bytes")
    places.update(_places(keys, by_key, stream.tell()))
    return value


def _places(keys: list[object], storages: Mapping[str, Storage], start: int) -> dict[str, int]:
    """Return the offset of the numbers of every storage."""
    places = {}
    for key in keys:
        if not isinstance(key, str) or key not in storages:
            raise MismatchError("keys of storages of the content", "another key")
        places[key] = start + COUNT_BYTES
        start = places[key] + storages[key].count * storages[key].type.itemsize
    return places
