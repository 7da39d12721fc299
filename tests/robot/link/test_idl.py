"""Types of DDS, with Unitree's hashes, so that either side accepts the other's types."""

import pytest

from spikeport.robot.link.messages import (
    LOW_CMD,
    LOW_STATE,
    REQUEST,
    RESPONSE,
    SPORT_MODE_STATE,
    Struct,
)

pytest.importorskip("cyclonedds", reason="cyclonedds is absent: pip install 'spikeport[link]'")

from cyclonedds.idl._xt_builder import XTBuilder

from spikeport.robot.link.idl import idl_type

HASHES = [
    (LOW_CMD, "52cc8eb0d427d692aa2b20a90540"),
    (LOW_STATE, "08f239c471d3a27e67e7c7723184"),
    (SPORT_MODE_STATE, "e59749630fff75cc170afb238783"),
    (REQUEST, "c47a4429fcbf539486498753c48f"),
    (RESPONSE, "d1c32cc02214901a464a6c51325d"),
]
"""Hashes of the complete types, hexadecimal, as far-unitree-sdk 0.1.8, which is built from
Unitree's C++ SDK, announces them."""


@pytest.mark.parametrize(
    ("struct", "hexadecimal"), HASHES, ids=[struct.name for struct, _ in HASHES]
)
def test_hashes_are_unitrees(struct: Struct, hexadecimal: str) -> None:
    information, _ = XTBuilder.process_type(idl_type(struct))
    found = bytes(information.complete.typeid_with_size.type_id.value)
    assert found.hex() == hexadecimal


def test_names_are_unitrees() -> None:
    assert idl_type(LOW_CMD).__idl_typename__ == "unitree_go.msg.dds_.LowCmd_"
    assert idl_type(REQUEST).__idl_typename__ == "unitree_api.msg.dds_.Request_"


def test_a_type_is_made_once() -> None:
    assert idl_type(LOW_STATE) is idl_type(LOW_STATE)
