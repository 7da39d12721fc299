"""Archives of arrays: numbers and texts within limits of size."""

import numpy as np
import pytest

from spikeport.reading import npz
from spikeport.reading.mismatch import MismatchError


def test_arrays_are_read_as_they_were_written(tmp_path):
    arrays = {
        "scalar": np.array(2.5),
        "columns": np.asfortranarray(np.arange(6, dtype=np.int16).reshape(2, 3)),
        "empty": np.zeros((0, 3)),
        "flags": np.array([True, False]),
        "text": np.array("häßlich"),
        "high": np.array([1, 2], dtype=">u4"),
    }
    np.savez_compressed(tmp_path / "a.npz", **arrays)
    found = npz.read(tmp_path / "a.npz")
    assert found.keys() == arrays.keys()
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize(
    ("array", "complaint"),
    [
        (np.array([{}], dtype=object), "numbers or texts in a.npy, found type object"),
        (np.array([b"x"]), "numbers or texts in a.npy, found type |S1"),
        (np.zeros(1, dtype=[("x", "i4")]), "numbers or texts in a.npy, found type [('x', '<i4')]"),
        (np.zeros((1,) * 9), "an array of at most 8 axes in a.npy, found 9"),
        (np.zeros(2**23 + 1, bool), "axes of 0 to 8,388,608 in a.npy, found 8,388,609"),
        (np.zeros((2**40, 0)), "axes of 0 to 8,388,608 in a.npy, found 1,099,511,627,776"),
    ],
)
def test_arrays_of_other_types_or_shapes_are_refused(tmp_path, array, complaint):
    np.savez(tmp_path / "a.npz", a=array)
    with pytest.raises(MismatchError) as caught:
        npz.read(tmp_path / "a.npz")
    assert str(caught.value) == f"expected {complaint}"


def test_a_longer_array_is_read_if_the_caller_allows_it(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", a=np.ones(2**23 + 1, np.uint8))
    found = npz.read(tmp_path / "a.npz", most=2**24)
    assert found["a"].sum() == 2**23 + 1
    with pytest.raises(MismatchError, match=r"at most 1,000,000 bytes in all"):
        npz.read(tmp_path / "a.npz", most=2**24, limit=10**6)


def test_a_file_of_a_single_array_is_refused_and_called_so(tmp_path):
    np.save(tmp_path / "a.npy", np.ones(3))
    with pytest.raises(MismatchError) as caught:
        npz.read(tmp_path / "a.npy")
    assert str(caught.value) == (
        "expected an archive of arrays (.npz), found a single array (.npy)"
    )
