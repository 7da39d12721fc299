"""Types of DDS for Unitree's messages.

Bytes are ``byte``, never ``uint8``: Cyclone 11 announces ``uint8`` as a kind of type that Cyclone
0.10.2, which Unitree's SDKs use, does not know, and ends their processes with a segmentation fault
as soon as they discover it. The hashes below are Unitree's own.
"""

import dataclasses
import functools
from types import new_class
from typing import Any

from cyclonedds import idl
from cyclonedds.idl import annotations, types
from cyclonedds.idl._xt_builder import XTBuilder

from spikeport.robot.link.messages import (
    LOW_CMD,
    LOW_STATE,
    REQUEST,
    RESPONSE,
    SPORT_MODE_STATE,
    Field,
    Struct,
)

HASHES = {
    LOW_CMD.name: "52cc8eb0d427d692aa2b20a90540",
    LOW_STATE.name: "08f239c471d3a27e67e7c7723184",
    SPORT_MODE_STATE.name: "e59749630fff75cc170afb238783",
    REQUEST.name: "c47a4429fcbf539486498753c48f",
    RESPONSE.name: "d1c32cc02214901a464a6c51325d",
}
"""Hashes of the complete types, hexadecimal, as far-unitree-sdk 0.1.8, which is built from
Unitree's C++ SDK, announces them."""

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
    # As Unitree's compiler of IDL makes types: both are part of the hash.
    return annotations.final(annotations.autoid("sequential")(dataclasses.dataclass(made)))


def type_hash(struct: Struct) -> str:
    """Return the hash by which a peer knows a type, hexadecimal."""
    information, _ = XTBuilder.process_type(idl_type(struct))
    return bytes(information.complete.typeid_with_size.type_id.value).hex()


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
