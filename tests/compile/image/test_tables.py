"""Tables of an image: frozen arrays in declared types."""

import numpy as np
import pytest

from spikeport.compile.image.tables import (
    LAYOUT,
    TABLES,
    InAxons,
    Inputs,
    Outputs,
    Reads,
    flat,
    offsets,
    part,
    positions,
    ranges,
)
from spikeport.errors import ImageError


def test_offsets_and_parts_divide_an_array() -> None:
    start = offsets([2, 0, 3])
    assert start.tolist() == [0, 2, 2, 5]
    assert [np.arange(5)[part(start, i)].tolist() for i in range(3)] == [[0, 1], [], [2, 3, 4]]
    assert offsets(np.array([], dtype=int)).tolist() == [0]


def test_flat_lays_arrays_end_to_end() -> None:
    assert flat([np.array([3, 1]), np.array([2])]).tolist() == [3, 1, 2]
    assert flat([], float).dtype == float


def test_ranges_begin_at_their_starts_and_have_their_lengths() -> None:
    assert ranges(np.array([10, 0, 5]), np.array([2, 0, 3])).tolist() == [10, 11, 5, 6, 7]


def test_a_table_holds_frozen_arrays_in_the_declared_types() -> None:
    given = np.array([4.0, 2.0])
    table = InAxons(row=given, base=[-1, 0])
    assert (table.row.dtype.str, table.base.dtype.str) == ("<i4", "<i4")
    assert table.row.tolist() == [4, 2]
    given[0] = 9
    assert table.row[0] == 4
    with pytest.raises(ValueError, match="read-only"):
        table.row[0] = 1


def test_an_array_that_is_frozen_already_is_shared() -> None:
    table = Inputs(size=np.array([1, 2]))
    assert Inputs(size=table.size).size is table.size


@pytest.mark.parametrize(
    ("array", "message"),
    [
        ([0.5], "reads.compartment: values of float64 do not fit into <i8"),
        ([[1]], "reads.compartment is an array of 2 dimensions, not 1"),
        (["a"], "reads.compartment: values of type <U1 are no numbers"),
    ],
)
def test_an_array_that_the_type_of_its_column_cannot_hold_is_refused(
    array: object, message: str
) -> None:
    with pytest.raises(ImageError) as caught:
        Reads(compartment=np.array(array))
    assert str(caught.value) == message


def test_a_table_of_starts_has_one_row_fewer_than_starts() -> None:
    assert len(Inputs(size=np.zeros(3, dtype=int))) == 3
    assert len(Outputs(start=np.array([0, 2, 5]), weight_start=np.array([0, 0, 0]))) == 2


def test_every_array_is_declared_once_and_refers_to_known_tables() -> None:
    columns = [column for table in TABLES for column in table.columns().values()]
    assert len(LAYOUT) == len(columns)
    known = {table.NAME for table in TABLES}
    assert {column.divides for column in columns} | {column.into for column in columns} <= {
        "",
        *known,
    }


def test_positions_lists_the_places_where_each_number_occurs() -> None:
    found = positions(np.array([2, 0, 2, 4]), 6)
    assert [where.tolist() for where in found] == [[1], [], [0, 2], [], [3], []]
    assert positions(np.zeros(0, dtype=int), 0) == []
