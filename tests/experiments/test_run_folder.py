import errno
import json
import os
import platform
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.experiments import run_folder


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def read(folder):
    def not_json(word):
        raise AssertionError(f"{word} is not JSON")

    return json.loads((folder / "result.json").read_text(), parse_constant=not_json)


def test_result_has_schema_and_versions(tmp_path):
    run_folder.write_result(tmp_path, {"metrics": {"reaches": 3}})
    result = read(tmp_path)
    assert result["schema"] == run_folder.RESULT_SCHEMA == 1
    assert result["metrics"] == {"reaches": 3}
    assert result["versions"]["python"] == platform.python_version()
    for package in ("spikeport", "numpy", "scipy", "nengo", "nengo-loihi", "mujoco"):
        assert result["versions"][package] == metadata.version(package)


def test_numbers_that_are_not_finite_become_null(tmp_path):
    odd = [float("nan"), np.float32("inf"), np.array([1.5, -np.inf]), {"deep": (np.nan, 2)}]
    run_folder.write_result(tmp_path, {"odd": odd})
    assert read(tmp_path)["odd"] == [None, None, [1.5, None], {"deep": [None, 2]}]


def test_a_folder_is_made_with_its_parents(tmp_path):
    with run_folder.opened(tmp_path / "a" / "b", "reach") as folder:
        assert folder == tmp_path / "a" / "b"
        assert folder.is_dir()


def test_two_runs_of_the_same_second_never_share_a_default_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with run_folder.opened(None, "reach") as first:
        (first / "result.json").touch()
    assert first.parent == Path("runs")

    class SameSecond:
        @staticmethod
        def now():
            return SameSecond

        @staticmethod
        def strftime(_):
            return first.name.removeprefix("reach-")

    monkeypatch.setattr(run_folder, "datetime", SameSecond)
    with pytest.raises(UsageError) as caught, run_folder.opened(None, "reach"):
        pass
    assert str(caught.value) == f"{first}: cannot be made (File exists); choose another --out"


def test_a_folder_that_cannot_be_written_to_is_refused(tmp_path, monkeypatch):
    """On a read-only file system, even removing an absent file fails."""
    (tmp_path / "result.json").write_text("{}")

    def read_only(path, *_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    monkeypatch.setattr(Path, "unlink", read_only)
    monkeypatch.setattr(os, "access", lambda _, mode, **__: not mode & os.W_OK)
    with pytest.raises(UsageError) as caught, run_folder.opened(tmp_path, "reach", overwrite=True):
        pass
    assert str(caught.value) == f"{tmp_path}: cannot be written to; choose another --out"


def test_a_run_is_kept_unless_it_may_be_overwritten(tmp_path):
    (tmp_path / "result.json").write_text("{}")
    with pytest.raises(UsageError) as caught, run_folder.opened(tmp_path, "reach"):
        pass
    assert str(caught.value) == (
        f"{tmp_path}: holds a run; choose another --out, or give --overwrite"
    )
    with run_folder.opened(tmp_path, "reach", overwrite=True):
        assert names(tmp_path) == ["result.json"]
    assert names(tmp_path) == ["result.json"]


def test_other_files_are_never_overwritten(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    opened = run_folder.opened(tmp_path, "reach", overwrite=True)
    with pytest.raises(UsageError) as caught, opened:
        pass
    assert str(caught.value) == f"{tmp_path}: holds more than a run; choose another --out"


def test_clear_removes_a_run_and_its_result_first(tmp_path, monkeypatch):
    removed = []
    unlink = Path.unlink

    def watched(path, **options):
        removed.append(path.name)
        unlink(path, **options)

    monkeypatch.setattr(Path, "unlink", watched)
    for name in run_folder.FILES:
        (tmp_path / name).touch()
    run_folder.clear(tmp_path)
    assert names(tmp_path) == []
    assert removed[0] == "result.json"


def test_a_run_replaces_an_earlier_one_whole(tmp_path):
    run_folder.write_result(tmp_path, {"number": 1})
    (tmp_path / "video.mp4").touch()
    (tmp_path / ".run1234.part").mkdir()  # of a run that was killed
    with run_folder.renewed(tmp_path) as new:
        (new / "figure.png").touch()
        (new / run_folder.COUNTS).mkdir()
        run_folder.write_result(new, {"number": 2})
        assert read(tmp_path)["number"] == 1
    assert read(tmp_path)["number"] == 2
    assert names(tmp_path) == ["counts", "figure.png", "result.json"]


def test_an_earlier_run_stays_if_a_later_one_cannot_be_written(tmp_path):
    run_folder.write_result(tmp_path, {"number": 1})
    (tmp_path / "figure.png").write_bytes(b"first")

    def write():
        with run_folder.renewed(tmp_path) as new:
            (new / "figure.png").write_bytes(b"second")
            raise OSError("the disk is full")

    with pytest.raises(OSError, match="full"):
        write()
    assert names(tmp_path) == ["figure.png", "result.json"]
    assert (tmp_path / "figure.png").read_bytes() == b"first"


def interrupt(folder, writes):
    with run_folder.opened(folder, "reach"):
        if writes:
            (folder / "figure.png").touch()
        raise KeyboardInterrupt


def test_an_interrupted_run_removes_its_folder_only_if_it_is_empty(tmp_path):
    for name in ("empty", "full"):
        with pytest.raises(KeyboardInterrupt):
            interrupt(tmp_path / name, writes=name == "full")
    assert names(tmp_path) == ["full"]


def test_an_interrupt_in_an_existing_folder_is_raised_and_the_folder_stays(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        interrupt(Path("."), writes=False)
    assert tmp_path.is_dir()


def test_a_folder_that_cannot_be_removed_hides_no_interrupt(tmp_path, monkeypatch):
    def busy(path, *_, **__):
        raise OSError(errno.EBUSY, os.strerror(errno.EBUSY), str(path))

    for name in ("unlink", "rmdir"):
        monkeypatch.setattr(Path, name, busy)
    with pytest.raises(KeyboardInterrupt):
        interrupt(tmp_path / "mount", writes=False)


def test_a_folder_that_a_run_writes_into_is_refused_and_left_alone(tmp_path):
    folder = tmp_path / "run"
    with run_folder.opened(folder, "reach"):
        second = run_folder.opened(folder, "reach", overwrite=True)
        with pytest.raises(UsageError) as caught, second:
            pass
        assert folder.is_dir()
        (folder / "result.json").touch()
    assert str(caught.value) == (
        f"{folder}: another process writes into it; wait until it ends, or choose another --out"
    )
    with run_folder.opened(folder, "reach", overwrite=True):
        pass


def test_the_last_states_replace_an_earlier_run(tmp_path):
    (tmp_path / "result.json").write_text("{}")
    states = {"time_s": np.arange(3.0), "qpos": np.ones((3, 26))}
    path = run_folder.write_last_states(tmp_path, states)
    assert names(tmp_path) == ["last_states.npz"]
    with np.load(path) as file:
        assert {name: file[name].shape for name in file.files} == {"time_s": (3,), "qpos": (3, 26)}


def test_a_folder_with_nothing_but_last_states_does_not_hold_a_run(tmp_path):
    run_folder.add_last_states(tmp_path, {})
    with run_folder.opened(tmp_path, "reach"):
        run_folder.write_result(tmp_path, {})
    with pytest.raises(UsageError, match="holds a run"), run_folder.opened(tmp_path, "reach"):
        pass


FULL = """
import resource, sys
import numpy as np, xarray as xr
from pathlib import Path
from spikeport.experiments.run_folder import add_counts, write_probes

folder, counted = map(Path, sys.argv[1:])
(counted / "counts-0.npz").write_bytes(bytes(10_000))
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    WRITE
except OSError as error:
    print("refused:", error.filename, error.strerror)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("write", "file"),
    [
        ('write_probes(folder, xr.Dataset({"a": ("t", np.arange(10_000.0))}))', "probes.nc"),
        ("add_counts(folder, counted)", "counts/counts-0.npz"),
    ],
)
def test_a_full_disk_raises_an_error_with_the_name_of_the_file(tmp_path, write, file):
    folder, counted = tmp_path / "run", tmp_path / "counted"
    counted.mkdir()
    command = [sys.executable, "-c", FULL.replace("WRITE", write), str(folder), str(counted)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"refused: {folder / file} File too large\n")
    assert not [path for path in folder.rglob("*") if path.is_file()]


@pytest.mark.parametrize("name", ["session.record", "result.json", "counts/x"])
def test_a_file_of_another_option_is_refused_inside_the_folder_of_the_run(tmp_path, name):
    with pytest.raises(UsageError, match=r"^--record .*: lies in .*, the folder of the run"):
        run_folder.check_outside(tmp_path, "--record", tmp_path / name)
    run_folder.check_outside(tmp_path / "run", "--record", tmp_path / name)
    run_folder.check_outside(tmp_path, "--record", None)
