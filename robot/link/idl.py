"""DDS types of Unitree's messages.

Bytes are ``byte``, never ``uint8``: Cyclone 11 announces ``uint8`` as a type kind that Cyclone
0.10.2, which Unitree's SDKs use, does not know. Their processes end with a segmentation fault as
soon as they discover it.
"""

import dataclasses
import functools
from types import new_class
from typing import Any

from cyclonedds import idl
from cyclonedds.idl import annotations, types

from spikeport.robot.link.messages import Field, Struct

_TYPES = {
    "u1": types.byte,
    "i2": types.int16,
    "u2": types.uint16,
    "i4": types.int32,
    "u4": types.uint32,
    "f4": types.float32,
    "i8": types.int64,
    "bool": bool,
    "text": str,
    "bytes": types.sequence[types.byte],
}
_EMPTY = {"f4": 0.0, "bool": False, "text": ""}


@functools.cache
def idl_type(struct: Struct) -> Any:
    """Return the type of a struct, a dataclass whose defaults are zeros."""
    body = {
        "__annotations__": {field.name: _type(field) for field in struct.fields},
        **{field.name: _zeros(field) for field in struct.fields},
    }
    name = {"typename": f"{struct.package}.msg.dds_.{struct.name}"}
    made = new_class(struct.name, (idl.IdlStruct,), name, lambda space: space.update(body))
    # As Unitree's IDL compiler does: both annotations enter the hash by which peers match types.
    return annotations.final(annotations.autoid("sequential")(dataclasses.dataclass(made)))


def _type(field: Field) -> Any:
    kind = _TYPES[field.kind] if isinstance(field.kind, str) else idl_type(field.kind)
    return types.array[kind, field.length] if field.length else kind


def _zeros(field: Field) -> Any:
    def zero() -> Any:
        if isinstance(field.kind, Struct):
            return idl_type(field.kind)()
        return [] if field.kind == "bytes" else _EMPTY.get(field.kind, 0)

    length = field.length
    return dataclasses.field(
        default_factory=lambda: [zero() for _ in range(length)] if length else zero()
    )
