import errno
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from spikeport.atomic import (
    atomic_path,
    check_apart,
    check_output,
    check_results_folder,
    locked,
    write_text,
)
from spikeport.errors import UsageError


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_appears_with_its_content(tmp_path):
    write_text(tmp_path / "a.txt", "µ\n")
    assert (tmp_path / "a.txt").read_bytes() == "µ\n".encode()
    assert names(tmp_path) == ["a.txt"]


def test_an_old_file_is_replaced(tmp_path):
    write_text(tmp_path / "a.txt", "old and long")
    write_text(tmp_path / "a.txt", "new")
    assert (tmp_path / "a.txt").read_text() == "new"


def test_missing_folders_are_made(tmp_path):
    write_text(tmp_path / "b" / "c" / "a.txt", "x")
    assert (tmp_path / "b" / "c" / "a.txt").read_text() == "x"


def test_the_path_does_not_exist_until_the_file_is_whole(tmp_path):
    path = tmp_path / "a.txt"
    with atomic_path(path) as temporary:
        temporary.write_text("half")
        assert not path.exists()
        assert temporary.parent == path.parent  # a rename between file systems is not atomic
    assert path.read_text() == "half"


def fail_half_way(path, error):
    with atomic_path(path) as temporary:
        temporary.write_text("ne")
        raise error


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failure_in_the_middle_leaves_the_old_file_alone(tmp_path, error):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(error):
        fail_half_way(path, error)
    assert path.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_a_failure_before_the_first_byte_leaves_nothing(tmp_path):
    with pytest.raises(ValueError, match=r"^early$"), atomic_path(tmp_path / "a.txt"):
        raise ValueError("early")
    assert names(tmp_path) == []


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_the_error_of_a_full_disk_names_the_file_and_leaves_the_old_one(
    tmp_path, monkeypatch, step
):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, step, full)
    with pytest.raises(OSError, match="No space left on device") as caught:
        write_text(path, "new")
    assert caught.value.filename == str(path)
    assert path.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_the_error_of_a_read_only_file_system_names_the_path_and_a_cure(tmp_path, monkeypatch):
    def read_only(path, *_):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    monkeypatch.setattr(os, "open", read_only)
    with pytest.raises(UsageError) as caught:
        write_text(tmp_path / "a.txt", "new")
    assert str(caught.value) == (
        f"{tmp_path / 'a.txt'}: cannot be written (Read-only file system); choose another place"
    )


def test_a_path_below_a_file_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(UsageError) as caught:
        write_text(tmp_path / "file" / "a.txt", "new")
    assert str(caught.value) == (
        f"{tmp_path}/file/a.txt: cannot be written (File exists); choose another place"
    )


@pytest.mark.parametrize("function", ["open", "write"])
def test_an_error_of_the_temporary_file_names_the_path_that_was_asked_for(tmp_path, function):
    path = tmp_path / "a.txt"

    def write(temporary):
        raise OSError(errno.EIO, "broken", *([str(temporary)] if function == "open" else []))

    with pytest.raises(OSError, match="broken") as caught, atomic_path(path) as temporary:
        write(temporary)
    assert caught.value.filename == str(path)


def test_check_output_refuses_a_path_whose_folder_cannot_be_written_into(tmp_path, monkeypatch):
    def refusal(path):
        with pytest.raises(UsageError) as caught:
            check_output("--out", path)
        return str(caught.value)

    new = tmp_path / "new" / "folder" / "a.txt"
    check_output("--out", new)
    assert names(tmp_path) == []
    (tmp_path / "file").touch()
    below = tmp_path / "file" / "a.txt"
    assert refusal(below) == (f"--out {below}: {tmp_path}/file is no folder; choose another")
    # Not by chmod: root may write anywhere.
    monkeypatch.setattr(os, "access", lambda _, mode, **__: not mode & os.W_OK)
    assert refusal(new) == (
        f"--out {new}: the folder {tmp_path} cannot be written into; choose another"
    )


def test_check_output_refuses_a_name_that_is_too_long(tmp_path):
    path = tmp_path / ("a" * 300 + ".html")
    with pytest.raises(UsageError, match=r"^--html .*: a name of more than 200 bytes; choose anot"):
        check_output("--html", path, suffix=".html")


def test_a_folder_is_not_replaced(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(UsageError, match="is not a file that can be replaced"):
        write_text(tmp_path / "a", "x")
    assert names(tmp_path) == ["a"]


def test_a_planted_link_is_not_followed(tmp_path, monkeypatch):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    tokens = iter(["guessed", "fresh"])
    monkeypatch.setattr("spikeport.atomic.secrets.token_hex", lambda _n: next(tokens))
    (tmp_path / ".a.txt.guessed.part").symlink_to(victim)
    write_text(tmp_path / "a.txt", "new")
    assert victim.read_text() == "precious"
    assert (tmp_path / "a.txt").read_text() == "new"
    assert not (tmp_path / "a.txt").is_symlink()


def test_threads_may_write_one_path(tmp_path):
    path, texts = tmp_path / "a.txt", [str(n) * 1000 for n in range(8)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda n: write_text(path, texts[n % 8]), range(400)))
    assert path.read_text() in texts
    assert names(tmp_path) == ["a.txt"]


@pytest.mark.parametrize("umask", [0o022, 0o077])
def test_a_file_has_the_permissions_of_the_umask(tmp_path, umask):
    before = os.umask(umask)
    try:
        write_text(tmp_path / "a.txt", "x")
    finally:
        os.umask(before)
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o666 & ~umask


def test_a_locked_folder_is_refused_until_its_lock_ends(tmp_path):
    with locked(tmp_path), pytest.raises(UsageError, match="another process"), locked(tmp_path):
        pass
    with locked(tmp_path):
        assert names(tmp_path) == []


def test_a_lock_ends_with_the_process_that_holds_it(tmp_path):
    hold = "import os, sys, pathlib, spikeport.atomic as a\n"
    hold += "with a.locked(pathlib.Path(sys.argv[1])): print('held', flush=True); input()"
    command = [sys.executable, "-c", hold, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(UsageError, match="another process"), locked(tmp_path):
            pass
        holder.kill()
    with locked(tmp_path):
        pass


@pytest.mark.parametrize("link", [False, True])
def test_a_pipe_is_not_replaced_by_a_file(tmp_path, link):
    pipe, path = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    path.symlink_to(pipe)
    path = path if link else pipe
    with pytest.raises(UsageError) as caught:
        write_text(path, "text")
    assert str(caught.value) == f"{path}: is not a file that can be replaced; choose another"
    assert pipe.is_fifo()
    assert len(list(tmp_path.iterdir())) == 2


def test_names_of_files_that_are_not_utf_8_are_escaped_in_a_text(tmp_path):
    write_text(tmp_path / "page.html", "policy p\udcff.npz")
    assert (tmp_path / "page.html").read_text() == r"policy p\udcff.npz"


def test_a_new_folder_is_neither_a_file_nor_a_runs_nor_of_too_long_a_name(tmp_path):
    def refusal(path):
        with pytest.raises(UsageError) as caught:
            check_results_folder("--out", path)
        return str(caught.value).removeprefix(f"--out {path}: ")

    check_results_folder("--out", tmp_path / "new" / "folder")
    long = tmp_path / ("n" * 256)
    assert refusal(long) == "a folder's name of more than 255 bytes; choose another"
    assert refusal(long / "inner") == "a folder's name of more than 255 bytes; choose another"
    (tmp_path / "file").touch()
    assert refusal(tmp_path / "file") == "is a file; choose a folder"
    for name in ("result.json", "sweep.json"):
        (folder := tmp_path / f"{name}-folder").mkdir()
        (folder / name).touch()
        assert refusal(folder) == f"holds a run, {name}; choose another folder"


def test_a_path_that_cannot_be_looked_up_is_refused_as_one_that_cannot_be_written(tmp_path):
    with pytest.raises(UsageError, match="cannot be written"), atomic_path(tmp_path / ("n" * 300)):
        pass


def test_a_link_to_itself_is_replaced_by_a_file(tmp_path):
    (path := tmp_path / "r.json").symlink_to(path)
    check_apart([("--json", path), ("--html", tmp_path / "r.html")])
    with atomic_path(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"
