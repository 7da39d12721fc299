"""Checkpoints: their content, the latest one, and files that are refused."""

import pytest

pytest.importorskip("torch")

import numpy as np
import torch

from spikeport.errors import UsageError
from spikeport.training.checkpoint import Checkpoint, latest, load, path_of, save
from tests.helpers.full_disk import largest_file

ENTRY = {"segment": 1, "step": 32, "stage": "walk", "reward": 0.5}


def checkpoint(segment):
    learner = {"weights": torch.arange(3.0)}
    return Checkpoint({"seed": 3}, segment, learner, [ENTRY])


def test_a_checkpoint_is_read_as_it_was_written(tmp_path):
    save(tmp_path, checkpoint(7))
    assert [path.name for path in (tmp_path / "checkpoints").iterdir()] == ["00007.pt"]
    found = load(path_of(tmp_path, 7))
    assert (found.options, found.segment, found.log) == ({"seed": 3}, 7, checkpoint(7).log)
    assert torch.equal(found.learner["weights"], torch.arange(3.0))


def test_a_full_disk_leaves_the_checkpoints_before(tmp_path):
    save(tmp_path, checkpoint(1))
    with largest_file(100), pytest.raises(OSError, match="File too large") as error:
        save(tmp_path, checkpoint(2))
    assert error.value.filename == str(path_of(tmp_path, 2))
    assert [path.name for path in (tmp_path / "checkpoints").iterdir()] == ["00001.pt"]


def test_the_latest_checkpoint_is_that_of_the_last_segment(tmp_path):
    assert latest(tmp_path) is None
    for segment in (9, 10, 2):
        save(tmp_path, checkpoint(segment))
    assert latest(tmp_path) == path_of(tmp_path, 10)


@pytest.mark.parametrize("name", ["best.pt", "3.pt", "000003.pt"])
def test_a_copy_of_a_checkpoint_is_not_the_latest(tmp_path, name):
    for segment in (1, 2):
        save(tmp_path, checkpoint(segment))
    (tmp_path / "checkpoints" / name).write_bytes(path_of(tmp_path, 1).read_bytes())
    assert latest(tmp_path) == path_of(tmp_path, 2)


def test_a_checkpoint_of_another_segment_than_its_name_says_is_refused(tmp_path):
    save(tmp_path, checkpoint(1))
    path_of(tmp_path, 1).rename(path_of(tmp_path, 9))
    with pytest.raises(
        UsageError, match=r"expected a file 00001\.pt, by its segment, found 00009\.pt"
    ):
        load(path_of(tmp_path, 9))


@pytest.mark.parametrize("content", [b"", b"not a checkpoint"])
def test_a_file_that_is_not_a_checkpoint_is_refused(tmp_path, content):
    path = tmp_path / "x.pt"
    path.write_bytes(content)
    with pytest.raises(UsageError, match="is not a checkpoint of this version"):
        load(path)


def test_a_checkpoint_of_another_version_is_refused(tmp_path):
    path = tmp_path / "x.pt"
    torch.save({"segment": 1}, path)
    with pytest.raises(UsageError, match=r"not a checkpoint of this version \(TypeError\)"):
        load(path)


def test_a_checkpoint_with_a_flipped_bit_is_refused(tmp_path):
    save(tmp_path, checkpoint(1))
    path = path_of(tmp_path, 1)
    content = bytearray(path.read_bytes())
    content[content.index(np.arange(3, dtype="<f4").tobytes()) + 5] ^= 1
    path.write_bytes(content)
    with pytest.raises(UsageError, match="Bad CRC-32"):
        load(path)


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        ({"options": None}, "options and a learner, found other values"),
        ({"learner": 3}, "options and a learner, found other values"),
        ({"segment": "1"}, "a number of segments, found 1"),
        ({"segment": 0}, "a number of segments, found 0"),
        ({"log": [{"step": 1}]}, "a log of segments, found another value"),
        ({"log": [3]}, "a log of segments, found another value"),
        ({"log": {}}, "a log of segments, found another value"),
    ],
    ids=str,
)
def test_a_checkpoint_with_invalid_values_is_refused(tmp_path, spoilt, words):
    path = tmp_path / "x.pt"
    torch.save({**checkpoint(1)._asdict(), **spoilt}, path)
    with pytest.raises(UsageError, match=rf"not a checkpoint of this version \(expected {words}\)"):
        load(path)
