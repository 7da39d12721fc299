"""A few hundred spoilt files for each loader; `python -m tests.fuzz` can run for hours."""

import functools
import os
import random

import pytest

from spikeport.errors import SpikeportError, UsageError
from tests.fuzz.fuzzing import Tally, fuzz, good_files
from tests.fuzz.loaders import LOADERS, Loader
from tests.fuzz.mutations import mutated

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
MUTATIONS = 300
FEWER = {"NIR": 60, "run": 60}
"""Fewer files, for loaders that read each in a process of its own."""


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Return a function that writes a loader's good files once for all tests."""
    return functools.cache(lambda name: good_files(LOADERS[name], tmp_path_factory.mktemp("good")))


@pytest.mark.slow
@pytest.mark.parametrize("name", LOADERS)
def test_spoilt_files_are_read_or_refused(name, good):
    tally, mutations = Tally(), FEWER.get(name, MUTATIONS)
    fuzz(LOADERS[name], good(name), mutations, seed=0, tally=tally)
    assert tally.failures == []
    assert tally.tried == mutations
    assert tally.refused > mutations / 10


MESSAGES = ("remote", "sport mode", "frames", "bodies", "answers", "port answers", "robot messages")
"""Loaders whose files stand for messages: the tests themselves read them."""
IN_FOLDERS = "sweep's"
"""Loaders whose files the tests copy into a folder."""


@pytest.mark.parametrize(
    "name", [name for name in LOADERS if not name.startswith((*MESSAGES, IN_FOLDERS))]
)
def test_a_path_that_is_not_a_regular_file_is_refused(name, good, tmp_path):
    path, *_ = good(name)
    places = [tmp_path / f"{place}{path.suffix}" for place in ("none", "folder", "loop", "n" * 300)]
    places[1].mkdir()
    places[2].symlink_to(places[2])
    os.mkfifo(pipe := tmp_path / f"pipe{path.suffix}")
    for odd in (*places, pipe, path / path.name):
        with pytest.raises(SpikeportError) as caught:
            LOADERS[name].load(odd)
        assert odd.name in str(caught.value)


def test_files_that_are_neither_read_nor_refused_are_kept(tmp_path):
    def load(path):
        if path.read_bytes() == b"good":
            return
        if len(path.read_bytes()) > 4:
            raise UsageError(f"{path}: too long")
        raise KeyError(path)

    tally = Tally()
    loader = Loader(lambda folder: (folder / "a.txt").write_bytes(b"good"), load)
    fuzz(loader, good_files(loader, tmp_path), 50, seed=0, tally=tally)
    assert tally.refused > 5
    assert len(tally.failures) > 5
    assert len(list(tmp_path.glob("*-failed.txt"))) == len(tally.failures)


def test_the_same_seed_spoils_a_file_in_the_same_way():
    content = bytes(range(256))
    assert mutated(content, random.Random("a")) == mutated(content, random.Random("a"))
    assert mutated(content, random.Random("a")) != mutated(content, random.Random("b"))
