"""The cache: keys of everything that decides a result, damaged entries, limits of size and age."""

import os
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

from spikeport import cache
from spikeport.cache import FOLDER, LIMIT_BYTES, NOTHING, OFF, Cache, of_user

MADE = {"weights": np.arange(6.0).reshape(2, 3), "digest": np.array("abc")}


class Maker:
    """Maker of arrays that counts how often it is called."""

    def __init__(self):
        self.n = 0

    def __call__(self):
        self.n += 1
        return MADE


@pytest.fixture
def make():
    return Maker()


@pytest.fixture
def kept(tmp_path):
    return Cache(tmp_path / "cache")


def same(found):
    return found.keys() == MADE.keys() and all((found[k] == MADE[k]).all() for k in MADE)


def test_a_result_is_made_once_and_read_afterwards_from_a_private_folder(kept, make):
    assert same(kept.kept("policy", (1, "a"), make))
    assert same(kept.kept("policy", (1, "a"), make))
    assert make.n == 1
    assert kept.folder.stat().st_mode & 0o777 == 0o700


def test_an_array_of_9_mib_is_kept(kept):
    """The values of a network on the host are one large array of bytes."""
    pool = {"pool": np.ones(9 * 2**20, np.uint8)}
    kept.kept("compile", 1, lambda: pool)
    found = kept.kept("compile", 1, lambda: pytest.fail("made again"))
    np.testing.assert_array_equal(found["pool"], pool["pool"])


@pytest.mark.parametrize("other", [("policy", (2, "a")), ("policy", (1, "b")), ("arm", (1, "a"))])
def test_another_input_or_kind_makes_another_result(kept, make, other):
    kept.kept("policy", (1, "a"), make)
    kept.kept(*other, make)
    assert make.n == 2


def test_other_surroundings_such_as_a_package_version_make_another_result(kept, make, monkeypatch):
    kept.kept("policy", 1, make)
    monkeypatch.setattr(cache, "surroundings", lambda: "another NumPy")
    kept.kept("policy", 1, make)
    assert make.n == 2


@pytest.mark.parametrize("name", ["numpy", "nengo-loihi", "mujoco"])
def test_surroundings_cover_versions_of_packages(monkeypatch, name):
    before = cache.surroundings()
    with monkeypatch.context() as other:
        other.setattr(cache, "version_of", lambda n: "0" if n == name else version(n))
        cache.surroundings.cache_clear()
        changed = cache.surroundings()
    cache.surroundings.cache_clear()
    assert changed != before == cache.surroundings()


@pytest.mark.parametrize(("api", "counts"), [("blas", True), ("openmp", False)])
def test_surroundings_cover_blas_libraries_but_not_openmp(monkeypatch, api, counts):
    def of(version):
        found = [{"user_api": api, **dict.fromkeys(cache.BLAS, version)}]
        monkeypatch.setattr(cache, "threadpool_info", lambda: found)
        return cache.surroundings.__wrapped__()

    assert (of("1") != of("2")) == counts


def test_spikeports_version_covers_its_code_chips_and_robots(monkeypatch):
    before, read = cache.own_version(), Path.read_bytes
    assert before.startswith(f"{version('spikeport')}+")
    for name in ("kernel.py", "loihi.toml", "h1.xml", "h1_walk.npz"):
        monkeypatch.setattr(
            Path, "read_bytes", lambda path, name=name: read(path) + b" " * (path.name == name)
        )
        assert cache.own_version.__wrapped__() != before, name


def test_spikeport_has_a_version_where_it_is_not_installed(monkeypatch):
    """It may run from its folder alone, by PYTHONPATH."""
    before = cache.own_version()
    monkeypatch.setattr(cache, "version_of", lambda _name: None)
    assert cache.own_version.__wrapped__() == before


def test_surroundings_cover_spikeports_version(monkeypatch):
    before = cache.surroundings()
    monkeypatch.setattr(cache, "own_version", lambda: "0.2.0+changed")
    assert cache.surroundings.__wrapped__() != before


def test_spikeports_version_ignores_lock_files_of_editors(monkeypatch):
    before, walk = cache.own_version(), os.walk
    monkeypatch.setattr(
        os, "walk", lambda *a, **k: ((f, d, [*names, ".#cli.py"]) for f, d, names in walk(*a, **k))
    )
    assert cache.own_version.__wrapped__() == before


def test_a_damaged_entry_is_made_anew_with_a_warning(kept, make):
    kept.kept("policy", 1, make)
    (path,) = kept.folder.iterdir()
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.warns(UserWarning, match=f"{path.name}: .*made anew"):
        assert same(kept.kept("policy", 1, make))
    assert make.n == 2
    kept.kept("policy", 1, make)
    assert make.n == 2


def test_an_entry_under_another_name_is_not_used(kept, make):
    kept.kept("policy", 1, make)
    (one,) = kept.folder.iterdir()
    kept.kept("policy", 2, make)
    (other,) = set(kept.folder.iterdir()) - {one}
    other.replace(one)
    with pytest.warns(
        UserWarning, match="expected the stored arrays, found altered arrays, or another entry's"
    ):
        kept.kept("policy", 1, make)
    assert make.n == 3


def test_a_folder_that_others_can_write_into_is_not_used(kept, make):
    kept.kept("policy", 1, make)
    kept.folder.chmod(0o777)
    for n in 2, 3:
        with pytest.warns(UserWarning, match="others can write into it; cure: chmod 700"):
            assert same(kept.kept("policy", 1, make))
        assert make.n == n


def test_an_unusable_folder_is_warned_of_once(kept, make):
    kept.folder.mkdir()
    kept.folder.chmod(0o777)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for key in range(3):
            kept.kept("policy", key, make)
    assert [str(one.message).partition(";")[0] for one in caught] == [
        f"cache: {kept.folder}: others can write into it"
    ]


def test_a_file_in_place_of_the_folder_is_warned_of_once(kept, make):
    kept.folder.touch()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        assert same(kept.kept("policy", 1, make))
    assert [str(one.message) for one in caught] == [
        f"cache: {kept.folder}: is no folder; cure: SPIKEPORT_CACHE=off, or a folder; the result "
        "is made anew"
    ]


def test_a_full_disk_gives_a_warning_and_the_result(kept, make, monkeypatch):
    def full(*_args, **_options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np.lib.format, "write_array", full)
    with pytest.warns(UserWarning, match="No space left on device"):
        assert same(kept.kept("policy", 1, make))
    assert list(kept.folder.iterdir()) == []


def test_threads_that_make_one_result_leave_one_whole_entry(kept, make):
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: kept.kept("policy", 1, make), range(16)))
    assert all(map(same, found))
    assert len(list(kept.folder.iterdir())) == 1


def test_the_oldest_entries_are_removed_above_the_size_limit(kept, make, monkeypatch):
    kept.kept("gait", 1, make)
    kept.kept("policy", 1, make)
    first, second = kept.entries()
    monkeypatch.setattr(cache, "LIMIT_BYTES", 5 * second.size // 2)
    kept.kept("policy", 2, make)
    assert first.path not in [entry.path for entry in kept.entries()]
    assert second.path in [entry.path for entry in kept.entries()]
    assert LIMIT_BYTES == 2**30


def test_clearing_removes_entries_and_nothing_else(kept, make):
    kept.kept("policy", 1, make)
    mine = {"notes.txt", "policy-final.npz"}
    for name in mine:
        (kept.folder / name).write_text("mine")
    assert len(kept.entries()) == kept.clear() == 1
    assert {path.name for path in kept.folder.iterdir()} == mine


def half_written(kept, age_s):
    """Write the file of a process that was killed while writing an entry; return its path."""
    kept.folder.mkdir(mode=0o700, exist_ok=True)
    path = kept.folder / f".policy-{'0' * 32}.npz.{age_s:08}.part"
    path.write_bytes(b"half")
    changed_s = time.time() - age_s
    os.utime(path, (changed_s, changed_s))
    return path


def test_clearing_removes_half_written_entries_and_locks(kept):
    half_written(kept, 0)
    (kept.folder / f".gait-{'0' * 32}.lock").touch()  # its process was killed
    mine = kept.folder / ".notes.txt.1a2b3c4d.part"
    mine.write_text("mine")
    assert kept.clear() == 0
    assert list(kept.folder.iterdir()) == [mine]


def test_half_written_entries_are_removed_after_a_day(kept, make):
    old, new = half_written(kept, 25 * 3600), half_written(kept, 23 * 3600)
    kept.kept("policy", 1, make)
    assert not old.exists()
    assert new.exists()


def test_environment_variables_choose_the_folder_of_the_users_cache(monkeypatch, tmp_path, make):
    assert of_user() is NOTHING
    monkeypatch.setenv(FOLDER, str(tmp_path / "a"))
    assert of_user().folder == tmp_path / "a"
    monkeypatch.delenv(FOLDER)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert of_user().folder == tmp_path / "spikeport"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert of_user().folder == tmp_path / ".cache" / "spikeport"
    cache.switch_off()
    assert os.environ[FOLDER] == OFF
    assert NOTHING.kept("policy", 1, make) is MADE


def test_a_user_without_a_home_keeps_nothing(monkeypatch, make):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    for name in (cache.FOLDER, "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    with pytest.warns(UserWarning, match="Could not determine home directory"):
        assert cache.of_user() is cache.NOTHING
