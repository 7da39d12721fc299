"""Types of DDS: their hashes are Unitree's, so that either side takes the other's for its own."""

import pytest

from spikeport.robot.link.messages import (
    LOW_CMD,
    LOW_STATE,
    REQUEST,
    RESPONSE,
    SPORT_MODE_STATE,
)

pytest.importorskip("cyclonedds", reason="cyclonedds is absent: pip install 'spikeport[link]'")

from spikeport.robot.link.idl import HASHES, idl_type, type_hash

MESSAGES = (LOW_CMD, LOW_STATE, SPORT_MODE_STATE, REQUEST, RESPONSE)


@pytest.mark.parametrize("struct", MESSAGES, ids=lambda struct: struct.name)
def test_hashes_are_unitrees(struct: object) -> None:
    assert type_hash(struct) == HASHES[struct.name]


def test_names_are_unitrees() -> None:
    assert idl_type(LOW_CMD).__idl_typename__ == "unitree_go.msg.dds_.LowCmd_"
    assert idl_type(REQUEST).__idl_typename__ == "unitree_api.msg.dds_.Request_"


def test_a_type_is_made_once() -> None:
    assert idl_type(LOW_STATE) is idl_type(LOW_STATE)
