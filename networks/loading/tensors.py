"""Tensors of torch's files as arrays: storages of numbers, and views of storages in pickles.

Numbers are read only when they are used: an optimizer's state costs nothing.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.lib.stride_tricks import as_strided

from spikeport.arrays import Floats
from spikeport.networks.loading.pickles import PLAIN, Known
from spikeport.networks.loading.refusal import SAVE
from spikeport.reading.archive import MOST_NUMBERS
from spikeport.reading.mismatch import MismatchError
from spikeport.reading.npz import MAX_AXES

TYPES = {
    "DoubleStorage": "f8",
    "FloatStorage": "f4",
    "HalfStorage": "f2",
    "BFloat16Storage": "u2",
    "LongStorage": "i8",
    "IntStorage": "i4",
    "ShortStorage": "i2",
    "CharStorage": "i1",
    "ByteStorage": "u1",
    "BoolStorage": "?",
}
"""NumPy's types of the numbers of a storage; a bfloat16 is the upper half of a float32."""

Order = Literal["<", ">"]
"""The order of a number's bytes: the low byte first, or the high byte first."""

MAX_SIZE = 2**63 - 1
"""The largest size of an axis, as in torch."""

Bytes = Callable[[str, int], bytes | memoryview]
"""A function that returns the content of a storage, by its key, up to a number of bytes."""


@dataclass(frozen=True)
class StorageType:
    """The name of a storage's type, which a pickle cannot call."""

    kind: str


@dataclass(frozen=True)
class Storage:
    """Numbers in a file: their type, the key of their place, and their count."""

    kind: str
    key: str
    count: int
    content: Bytes
    order: Order = "<"

    @property
    def type(self) -> np.dtype[Any]:
        """The type of its numbers."""
        return np.dtype(TYPES[self.kind]).newbyteorder(self.order)

    def numbers(self) -> np.ndarray:
        """Return the numbers as in the file, read anew; `values` converts them to floats."""
        if self.count > MOST_NUMBERS:
            most = f"at most {MOST_NUMBERS:,} numbers in storage {self.key}"
            raise MismatchError(most, f"{self.count:,}")
        size = self.count * self.type.itemsize
        content = self.content(self.key, size)
        if len(content) != size:
            raise MismatchError(f"{size:,} bytes in storage {self.key}", f"{len(content):,}")
        return np.frombuffer(content, self.type)

    def values(self, numbers: np.ndarray) -> Floats:
        """Return some of the numbers as floats."""
        if self.kind == "BFloat16Storage":
            numbers = (numbers.astype(np.uint32) << 16).view(np.float32)
        return numbers.astype(float)


@dataclass(frozen=True)
class Tensor:
    """A tensor in a file, as a view of a storage."""

    storage: Storage
    offset: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]

    def array(self) -> Floats:
        """Return the tensor's values; raise MismatchError if it is not a view of its storage."""
        sizes = (self.offset, *self.shape, *self.strides)
        if not all(type(n) is int and 0 <= n <= MAX_SIZE for n in sizes):
            wanted = "a tensor whose offset, sizes and strides are integers from 0 to 2^63 - 1"
            raise MismatchError(wanted, "other values")
        if len(self.shape) != len(self.strides) or len(self.shape) > MAX_AXES:
            wanted = f"a tensor with one stride for each size, at most {MAX_AXES} axes"
            found = f"{len(self.shape)} sizes, {len(self.strides)} strides"
            raise MismatchError(wanted, found)
        if max(self.shape, default=0) > MOST_NUMBERS:  # even if empty: a bias may have this size
            raise MismatchError(f"axes of at most {MOST_NUMBERS:,}", f"shape {self.shape}")
        # With Python's integers: NumPy's product of such sizes would wrap around.
        count = math.prod(self.shape)
        if count > min(self.storage.count, MOST_NUMBERS):
            most = f"a tensor of at most {min(self.storage.count, MOST_NUMBERS):,} numbers"
            raise MismatchError(most, f"shape {self.shape}")
        steps = ((n - 1) * stride for n, stride in zip(self.shape, self.strides, strict=True))
        if count and self.offset + sum(steps) >= self.storage.count:
            raise MismatchError(f"a tensor inside its storage {self.storage.key}", "one beyond it")
        if not count:
            return np.zeros(self.shape)
        # No stride is negative and the last number lies in the storage, so that the view below
        # reads nothing else.
        numbers = self.storage.numbers()
        strides = [numbers.itemsize * stride for stride in self.strides]
        return self.storage.values(as_strided(numbers[self.offset :], self.shape, strides))


def tensor(storage: object, offset: int, shape: object, strides: object, *_: object) -> Tensor:
    """Return the tensor that torch would rebuild from these arguments."""
    match storage, shape, strides:
        case Storage(), tuple(), tuple():
            return Tensor(storage, offset, shape, strides)
    raise MismatchError("a tensor of a storage, sizes and strides", "other arguments")


def storages(content: Bytes, order: Order = "<") -> Callable[[object], Storage]:
    """Return a function that makes storages from a pickle's persistent identifiers."""

    def storage(identifier: object) -> Storage:
        match identifier:
            # The fourth item is the device, which does not matter for numbers in a file.
            case ("storage", StorageType(kind), str(key), str(), int(count), *_) if (
                0 <= count <= MAX_SIZE
            ):
                return Storage(kind, key, count, content, order)
        raise MismatchError("identifiers of storages of numbers", "another identifier")

    return storage


def _size(sizes: object) -> tuple[object, ...]:
    """Return the sizes of axes as a tuple; refuse other values, such as a long text."""
    match sizes:
        case tuple() | list() if len(sizes) <= MAX_AXES:
            return tuple(sizes)
    raise MismatchError(f"sizes of at most {MAX_AXES} axes", type(sizes).__name__)


def empty() -> dict[object, object]:
    """Return an empty ordered dictionary; a call with arguments is refused."""
    return {}


KNOWN: Mapping[str, Known] = {
    "torch._utils._rebuild_tensor_v2": Known(tensor),
    "torch._utils._rebuild_parameter": Known(lambda data, *_: data),
    "torch.Size": Known(_size),
    "torch.device": Known(lambda *_: None),
    "collections.OrderedDict": Known(empty),
}


def plain_name(name: str) -> object:
    """Return the meaning of a name in a checkpoint's pickle."""
    kind = name.removeprefix("torch.")
    if kind in TYPES:
        return StorageType(kind)
    if name not in KNOWN:
        raise MismatchError(PLAIN, f"{name}, which may run code", cure=SAVE)
    return KNOWN[name]
