"""The kinds of a board's faults; the reading of plans is in `test_fault_plan`.

The effect of each fault on a run is in `test_chip`.
"""

import pytest

from spikeport.backends.board.faults import FAULTS, KINDS
from spikeport.errors import UsageError


def test_every_kind_can_be_asked_for() -> None:
    for kind in KINDS:
        assert FAULTS.parse("slow=2@1" if kind == "slow" else f"{kind}@1").kind == kind


def test_a_kind_of_a_robot_is_none_of_a_board() -> None:
    with pytest.raises(UsageError, match="--fault 'nan@3': write KIND@STEP, slow=MS@STEP or"):
        FAULTS.parse("nan@3")
