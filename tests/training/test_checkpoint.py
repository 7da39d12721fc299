"""Checkpoints: whole or not at all, the last one first."""

import pytest

pytest.importorskip("torch")

import torch

from spikeport.errors import UsageError
from spikeport.training.checkpoint import Checkpoint, latest, load, path_of, save


def checkpoint(segment):
    learner = {"weights": torch.arange(3.0)}
    return Checkpoint({"seed": 3}, segment, learner, [{"step": 32, "reward": 0.5}])


def test_a_checkpoint_is_read_as_it_was_written(tmp_path):
    save(tmp_path, checkpoint(7))
    assert [path.name for path in (tmp_path / "checkpoints").iterdir()] == ["00007.pt"]
    found = load(path_of(tmp_path, 7))
    assert (found.options, found.segment, found.log) == ({"seed": 3}, 7, checkpoint(7).log)
    assert torch.equal(found.learner["weights"], torch.arange(3.0))


def test_the_latest_is_that_of_the_last_segment(tmp_path):
    assert latest(tmp_path) is None
    for segment in (9, 10, 2):
        save(tmp_path, checkpoint(segment))
    assert latest(tmp_path) == path_of(tmp_path, 10)


@pytest.mark.parametrize("content", [b"", b"not a checkpoint"])
def test_another_file_is_refused(tmp_path, content):
    path = tmp_path / "x.pt"
    path.write_bytes(content)
    with pytest.raises(UsageError, match="is not a checkpoint of this version"):
        load(path)


def test_a_checkpoint_of_another_version_is_refused(tmp_path):
    path = tmp_path / "x.pt"
    torch.save({"segment": 1}, path)
    with pytest.raises(UsageError, match=r"not a checkpoint of this version \(TypeError\)"):
        load(path)
