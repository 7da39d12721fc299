"""Files of torch, new and old: their tensors, and the order of their bytes."""

import io

import numpy as np
import pytest
import torch

from spikeport.networks.loading.archive import Archive
from spikeport.networks.loading.refusal import MismatchError
from spikeport.networks.loading.torch_file import folder_of, pickled, pickled_in_a_row
from tests.helpers.foreign import members, pack

CONTENT = {"a": torch.arange(6.0).reshape(2, 3), "b": torch.tensor([7, 8]), "note": "x"}


def saved(**options: object) -> bytes:
    written = io.BytesIO()
    torch.save(CONTENT, written, **options)
    return written.getvalue()


def assert_same(found: object) -> None:
    assert isinstance(found, dict)
    assert found["note"] == "x"
    for name in "ab":
        np.testing.assert_array_equal(found[name].array(), CONTENT[name].double().numpy())


def test_an_archive_holds_its_pickle_and_its_storages_in_one_folder():
    archive = Archive(saved())
    folder = folder_of(archive, "a checkpoint")
    assert folder.endswith("/")
    assert_same(pickled(archive, folder, "data"))


def test_a_file_from_before_archives_holds_them_in_a_row():
    assert_same(pickled_in_a_row(saved(_use_new_zipfile_serialization=False)))


def test_numbers_with_their_high_bytes_first_are_read(tmp_path):
    path = tmp_path / "big.pt"
    torch.save({"a": torch.tensor([1.5, -2.0])}, path)
    content = members(path)
    (data,) = (name for name in content if name.endswith("data/0"))
    (order,) = (name for name in content if name.endswith("byteorder"))
    content[data] = np.array([1.5, -2.0], ">f4").tobytes()
    pack(path, {**content, order: b"big"})
    archive = Archive(path.read_bytes())
    found = pickled(archive, folder_of(archive, "a checkpoint"), "data")
    np.testing.assert_array_equal(found["a"].array(), [1.5, -2.0])
    pack(path, {**content, order: b"middle"})
    archive = Archive(path.read_bytes())
    with pytest.raises(MismatchError, match="the order of bytes, little or big"):
        pickled(archive, folder_of(archive, "a checkpoint"), "data")


def test_an_archive_with_no_pickle_or_with_two_is_none_of_torch(tmp_path):
    path = tmp_path / "policy.pt"
    for names in ([], ["a/data.pkl", "b/data.pkl"], ["a/b/data.pkl"]):
        pack(path, dict.fromkeys(["other", *names], b"x"))
        with pytest.raises(MismatchError, match=r"data\.pkl in a folder"):
            folder_of(Archive(path.read_bytes()), "a checkpoint")
