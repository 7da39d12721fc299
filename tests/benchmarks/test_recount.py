"""Runs whose costs can be recomputed, and those that are refused."""

import hashlib
import json

import pytest
import recount


def folder(path, *words, counts=True, files=None):
    """Make the folder of a run by a command, which read files with these digests."""
    (path / "counts").mkdir()
    result = {"command": ["spikeport", "run", *words], "files": files or {}}
    (path / "result.json").write_text(json.dumps(result))
    if counts:
        (path / "counts" / "messages.npz").touch()
    return str(path)


def refusal(path, capsys):
    with pytest.raises(SystemExit):
        recount.main([path])
    return capsys.readouterr().err.splitlines()[-1]


def test_a_run_on_loihi_with_counts_is_accepted(tmp_path):
    assert recount.counted(folder(tmp_path, "reach", "--chip", "loihi")) == tmp_path


def test_a_run_on_loihis_file_is_accepted_and_on_another_of_that_name_refused(tmp_path, capsys):
    words = "reach", "--chip", "./chips/loihi.toml"
    for name, content in (("own", recount.LOIHI.read_bytes()), ("other", b"name = 'loihi'")):
        (tmp_path / name).mkdir()
        digest = hashlib.sha256(content).hexdigest()[:12]
        folder(tmp_path / name, *words, files={"chips/loihi.toml": digest})
    assert recount.counted(str(tmp_path / "own")) == tmp_path / "own"
    line = refusal(str(tmp_path / "other"), capsys)
    assert line.endswith("is a run on ./chips/loihi.toml; only loihi is recounted")


@pytest.mark.parametrize("words", [("--chip", "loihi2"), ("--chip=loihi2",)])
def test_a_run_on_another_chip_is_refused(tmp_path, capsys, words):
    line = refusal(folder(tmp_path, "reach", *words), capsys)
    assert line.endswith(f"{tmp_path}: is a run on loihi2; only loihi is recounted")


def test_a_run_without_counts_is_refused_with_a_cure(tmp_path, capsys):
    line = refusal(folder(tmp_path, "reach", counts=False), capsys)
    assert line.endswith(f"{tmp_path}: has no counts; run it again with --counts")


def test_a_folder_without_a_run_is_refused(tmp_path, capsys):
    assert "has no result.json" in refusal(str(tmp_path), capsys)


def test_figures_have_the_units_of_the_chips_file():
    found = recount._in_si({"a": {"value": 2, "unit": "nJ"}, "b": {"value": 3, "unit": "us"}})
    assert found == {"a": pytest.approx(2e-9), "b": pytest.approx(3e-6)}
