"""Values written to the cache and read back, and refusals of unknown kinds."""

import json
import sys

import nengo
import numpy as np
import pytest

from spikeport.backends.kept_values import NotKeptError, Reader, Writer
from spikeport.hardware_models.limits import Usage
from spikeport.reading.mismatch import MismatchError

SHARED = np.arange(6.0).reshape(2, 3)
VALUES = [
    None,
    True,
    3,
    0.1,
    "text",
    [1, (2, "a")],
    {"a": [1], 2: None},
    slice(1, None, 2),
    Usage("core 0", "compartments", 3, None, "compartments"),
    nengo.Alpha(0.01),
    nengo.LIF(tau_rc=0.03),
]


def back(value, spoil=lambda tree: tree):
    writer = Writer({id(SHARED): ["called", 0]})
    tree = spoil(writer.write(value))
    reader = Reader(writer.arrays(tree))
    reader.reference = lambda reference: SHARED if reference == ["called", 0] else None
    return reader.read(reader.tree)


@pytest.mark.parametrize("value", VALUES, ids=str)
def test_a_written_value_is_read_back_equal(value):
    found = back(value)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize("order", "CF")
def test_an_array_is_read_back_in_its_memory_order(order):
    array = np.array([[1, 2], [3, 4]], dtype="i2", order=order)
    found = back([array, array])
    np.testing.assert_array_equal(found[0], array, strict=True)
    assert found[0].strides == array.strides
    assert found[0] is found[1]


def test_a_reference_is_read_as_the_object_itself():
    assert back(SHARED) is SHARED


@pytest.mark.parametrize(
    "value", [object(), print, np.array([print]), np.array(["a"]), nengo.PES(), {1, 2}]
)
def test_values_of_unknown_kinds_are_not_written(value):
    with pytest.raises(NotKeptError, match="cannot be kept in a cache"):
        back(value)


FOREIGN = [
    ["call", "os.system"],
    ["frozen", ["os", "system"], {}],
    ["data", ["spikeport.compile.pipeline", "Path"], ["dict", []]],
    ["data", ["spikeport.hardware_models.limits", "Usage"], ["dict", []]],
    ["tuple_of", ["spikeport.compile.pipeline", "Compilation"], []],
    ["frozen", ["nengo.synapses", "IntParam"], ["dict", []]],
    # These would be made, or imported, if modules were not looked up in a list.
    ["tuple_of", ["urllib.parse", "SplitResult"], ["a", "b", "c", "d", "e"]],
    ["frozen", ["this", "s"], ["dict", []]],
]


@pytest.mark.parametrize("tree", FOREIGN, ids=str)
def test_entries_of_unknown_kinds_are_not_read(tree):
    with pytest.raises(MismatchError):
        back(None, spoil=lambda _: tree)
    assert "this" not in sys.modules


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (("|O", [1], "C", 0), "expected an array of numbers, found one of"),
        (("O,f8", [0], "C", 0), "expected an array of numbers, found one of"),
        (("<U1", [1], "C", 0), "expected an array of numbers, found one of"),
        (("<f8", [-1], "C", 0), "expected an array of numbers, found one of"),
        (("<f8", [2], "C", 0), "expected bytes up to 8, found 0 to 16"),
        (("<f8", [1], "C", -8), "expected bytes up to 8, found -8 to 0"),
        (("<f8", [2**40, 2**40], "C", 0), "expected bytes up to 8"),
    ],
    ids=str,
)
def test_an_array_outside_the_pool_or_not_of_numbers_is_refused(entry, message):
    text = json.dumps([["array", 0], [entry]]).encode()
    reader = Reader({"tree": np.frombuffer(text, np.uint8), "pool": np.ones(8, np.uint8)})
    with pytest.raises(MismatchError, match=message):
        reader.read(reader.tree)


def test_unknown_fields_of_a_class_are_refused():
    tree = ["data", ["spikeport.compile.report.report", "Report"], ["dict", [["other", 1]]]]
    with pytest.raises(MismatchError, match=r"expected fields .*chip.*, found other"):
        back(None, spoil=lambda _: tree)
