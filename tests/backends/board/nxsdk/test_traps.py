"""Ids of traps, and the text of a finding."""

from spikeport.backends.board.nxsdk import traps
from spikeport.backends.board.nxsdk.traps import BASES, THRESHOLDS, Finding, Trap


def test_ids_are_in_order() -> None:
    ids = [trap.id for trap in vars(traps).values() if isinstance(trap, Trap)]
    assert ids == [f"NX{i + 1:02}" for i in range(len(ids))]
    assert len(ids) == 15


def test_a_finding_names_its_trap_its_place_and_the_cure() -> None:
    assert str(Finding(THRESHOLDS, "core 3", "8, at most 7")) == (
        "NX01 threshold profiles of a core: core 3: 8, at most 7; "
        "cure: one block a core: compile with -p unpacked, or compact_unpacked"
    )
    assert str(Finding(BASES, "g", "257, at most 256")).startswith("NX07 refused: compartment")
