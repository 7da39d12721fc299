"""Files of torch: zip archives, and the format before them."""

import io
import pickle

import numpy as np
import pytest
import torch

from spikeport.networks.loading.torch_file import MAGIC, folder_of, pickled, pickled_in_a_row
from spikeport.reading.archive import Archive
from spikeport.reading.mismatch import MismatchError
from tests.helpers.foreign import members, pack


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "file.pt"
    torch.save({"a": torch.arange(6.0).reshape(2, 3).T, "b": torch.arange(10)[3:5]}, path)
    return path


def read(path):
    archive = Archive(path.read_bytes())
    return pickled(archive, folder_of(archive, "a file"), "data")


def check(content):
    np.testing.assert_array_equal(content["a"].array(), [[0, 3], [1, 4], [2, 5]])
    np.testing.assert_array_equal(content["b"].array(), [3, 4])


def test_tensors_are_views_of_their_storages(path):
    check(read(path))


def test_big_endian_numbers_are_read(path):
    content = members(path)
    for key, kind in (("0", "f4"), ("1", "i8")):
        numbers = np.frombuffer(content[f"file/data/{key}"], kind)
        content[f"file/data/{key}"] = numbers.astype(f">{kind}").tobytes()
    pack(path, {**content, "file/byteorder": b"big"})
    check(read(path))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"file/byteorder": b"middle"}, "the order of bytes, little or big, found b'middle'"),
        ({"file/byteorder": b"little" * 9}, "at most 16 bytes in file/byteorder, found 54"),
        ({"other/data.pkl": b""}, "a file, found an archive with 2 data.pkl in a folder"),
    ],
)
def test_a_malformed_archive_is_refused(path, change, complaint):
    pack(path, {**members(path), **change})
    with pytest.raises(MismatchError, match=complaint):
        read(path)


def test_a_file_from_before_zip_archives_is_read():
    stream = io.BytesIO()
    content = {"a": torch.arange(6.0).reshape(2, 3).T, "b": torch.arange(10)[3:5]}
    torch.save(content, stream, _use_new_zipfile_serialization=False)
    written = stream.getvalue()
    read = pickled_in_a_row(written)
    check(read)
    numbers = read["a"].storage.numbers()
    # Otherwise each view would copy the whole storage.
    assert np.shares_memory(numbers, np.frombuffer(written, np.uint8))


@pytest.mark.parametrize(
    ("parts", "complaint"),
    [
        ([1, 1001, {"little_endian": True}, {}, []], "a checkpoint of torch, found other pickles"),
        ([MAGIC, 1001, 5, {}, []], "a checkpoint of torch, found other pickles"),
        ([MAGIC, 1001, {"little_endian": False}, {}, []], "little-endian numbers"),
        (
            [MAGIC, 1001, {"little_endian": True}, {}, ["0"]],
            "keys of storages of the content, found another key",
        ),
        ([MAGIC, 1001, {"little_endian": True}, {}], "a whole pickle, found a damaged one"),
    ],
)
def test_other_sequences_of_pickles_are_refused(parts, complaint):
    with pytest.raises(MismatchError, match=complaint):
        pickled_in_a_row(b"".join(pickle.dumps(part, 2) for part in parts))
