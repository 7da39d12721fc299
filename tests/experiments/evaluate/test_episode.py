"""Episodes, as workers run them."""

import pickle
from types import SimpleNamespace

import pytest

from spikeport import cache
from spikeport.experiments.evaluate import episode
from spikeport.experiments.evaluate.episode import EpisodeRun
from spikeport.experiments.sweep.store import Store


@pytest.fixture
def store(sweep_of, monkeypatch, tmp_path):
    """Return the store that an episode's walker is made with, in a worker of a folder."""
    asked = []

    def find_walker(_settings, options):
        asked.append(options.cache)
        return SimpleNamespace(walk=lambda *_: None)

    monkeypatch.setattr(episode, "find_walker", find_walker)
    monkeypatch.setattr(episode, "measure", lambda _: {"falls": 0})
    (point,) = sweep_of(varied={}).points()

    def found(run):
        run(point, str(tmp_path / "scratch"))
        return asked[-1]

    return found


@pytest.mark.parametrize("keeps", [True, False])
def test_workers_share_what_a_walker_needs(store, monkeypatch, tmp_path, keeps):
    """It is made once: a store lets one of them make it while the others wait."""
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "cache"))
    found = store(EpisodeRun("ab12", keeps))
    assert isinstance(found, Store)
    assert found.folder == tmp_path / ("cache" if keeps else "scratch/store-ab12")


def test_without_a_cache_none_is_used_on_a_cluster_either(store, monkeypatch, tmp_path):
    monkeypatch.setenv(cache.FOLDER, cache.OFF)
    sent = pickle.dumps(EpisodeRun.new())
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "cache"))  # that of the cluster's machine
    assert store(pickle.loads(sent)).folder.parent == tmp_path / "scratch"
