"""``spikeport cache``."""

import numpy as np
import pytest

from spikeport.cache import FOLDER, Cache


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(FOLDER, str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_kinds_are_listed_and_cleared(spikeport, folder):
    for kind, key in (("policy", 1), ("policy", 2), ("gait", 1)):
        Cache(folder).kept(kind, key, lambda: {"x": np.random.RandomState(0).rand(2**17)})
    rows = [line.split() for line in spikeport("cache").out.splitlines()]
    assert ["gait", "1", "0.9", "0.0"] in rows
    assert ["policy", "2", "1.9", "0.0"] in rows
    assert spikeport("cache", "--clear").out == f"removed from {folder}: 3 entries\n"
    assert "policy" not in spikeport("cache").out


def test_the_command_says_that_the_cache_is_off(spikeport, monkeypatch):
    monkeypatch.setenv(FOLDER, "off")
    assert spikeport("cache").out == "the cache is off: SPIKEPORT_CACHE=off\n"
