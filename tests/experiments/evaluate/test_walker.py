"""Policies that walk episodes, exact and in spikes."""

import dataclasses
import gc
import pickle
import weakref
from types import SimpleNamespace

import numpy as np
import pytest

from spikeport import cache
from spikeport.errors import BackendError
from spikeport.experiments.evaluate import episode
from spikeport.experiments.evaluate.episode import EpisodeRun
from spikeport.experiments.evaluate.stage import Stage
from spikeport.experiments.evaluate.walker import (
    WALKERS,
    ExactWalker,
    SpikingWalker,
    find_walker,
)
from spikeport.experiments.options import Options
from spikeport.experiments.sweep.store import Store
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.trial import WalkTrial
from spikeport.networks import walking_policy
from spikeport.robot.perturbation import NONE, Perturbation
from spikeport.robot.terrain import Uneven
from spikeport.simulator import Simulator

OPTIONS = Options(2.0, backend="analytic", pipeline="compact")


def test_rows_and_seeds_share_a_walker():
    settings = WalkSettings()
    made = find_walker(settings, OPTIONS)
    assert isinstance(made, ExactWalker)
    pushed = dataclasses.replace(settings, push=0.8)
    assert find_walker(pushed, dataclasses.replace(OPTIONS, seed=3)) is made


def test_a_policy_file_that_changed_gets_another_walker(tmp_path):
    file, shipped = tmp_path / "policy.npz", walking_policy.load()
    shipped.save(file)
    made = find_walker(WalkSettings(policy=str(file)), OPTIONS)
    assert find_walker(WalkSettings(policy=str(file)), OPTIONS) is made
    dataclasses.replace(shipped, action_scale_rad=0.9 * shipped.action_scale_rad).save(file)
    assert find_walker(WalkSettings(policy=str(file)), OPTIONS) is not made


def test_an_episode_depends_on_its_seed_and_perturbation():
    walker = find_walker(WalkSettings(), OPTIONS)
    ends = [
        walker.walk(*asked).plant.data.qpos.copy()
        for asked in [
            (NONE, 1.0, 3),
            (NONE, 1.0, 3),
            (NONE, 1.0, 4),
            (Perturbation(mass=1.1), 1, 3),
        ]
    ]
    np.testing.assert_array_equal(ends[0], ends[1])
    assert not np.array_equal(ends[0], ends[2])
    assert not np.array_equal(ends[0], ends[3])


@pytest.mark.slow
@pytest.mark.usefixtures("short_gait")
def test_a_spiking_walker_repeats_an_episode_bit_for_bit_after_another(pocket):
    settings = WalkSettings(n_neurons=2, policy=pocket, calibrated=False)
    trial = WalkTrial(settings, Options(1.0, backend="native", pipeline="compact"))
    walker = SpikingWalker(trial)
    first = walker.walk(NONE, 0.5, 3).plant.data.qpos.copy()
    other = walker.walk(Perturbation(friction=0.3), 0.5, 4).plant.data.qpos
    again = walker.walk(NONE, 0.5, 3).plant.data.qpos
    np.testing.assert_array_equal(again, first)
    assert not np.array_equal(other, first)


@pytest.mark.slow
@pytest.mark.usefixtures("short_gait")
def test_a_robot_that_is_called_in_its_own_steps_alone_walks_as_if_called_in_all(
    monkeypatch, pocket
):
    settings = WalkSettings(n_neurons=2, policy=pocket, calibrated=False)
    walker = SpikingWalker(WalkTrial(settings, Options(1.0, backend="native", pipeline="compact")))
    actions, advance = [], Stage.advance

    def counted(stage, action):
        actions.append(action)
        return advance(stage, action)

    monkeypatch.setattr(Stage, "advance", counted)
    first = walker.walk(NONE, 0.2, 3).plant.data.qpos.copy()
    assert len(actions) == 1 + 40  # the network's first step, and each of the robot's
    monkeypatch.setattr(Stage, "skip", lambda stage: 0)
    in_all = walker.walk(NONE, 0.2, 3).plant.data.qpos
    assert len(actions) == 41 + 200
    np.testing.assert_array_equal(first, in_all)


@pytest.mark.slow
@pytest.mark.usefixtures("short_gait")
def test_a_walker_that_is_replaced_is_closed_and_freed(monkeypatch, pocket):
    options = dataclasses.replace(OPTIONS, backend="native")
    settings = WalkSettings(n_neurons=2, policy=pocket, calibrated=False)
    closed, close = [], Simulator.close
    first = weakref.ref(find_walker(settings, options))
    assert first() is not None
    monkeypatch.setattr(Simulator, "close", lambda sim: (close(sim), closed.append(sim.closed))[0])
    find_walker(WalkSettings(), OPTIONS)
    gc.collect()
    assert (first(), closed) == (None, [True])


def test_an_episode_ends_where_an_uneven_floor_may_have_its_edge(monkeypatch):
    rough = Perturbation(terrain="boxes:0.01")
    monkeypatch.setattr(Uneven, "reach_m", 0.2)
    stage = find_walker(WalkSettings(), OPTIONS).walk(rough, 4.0, 3)
    assert stage.over
    assert stage.legs.fallen_at_s is None
    assert 0.2 < np.hypot(*(stage.plant.data.qpos[:2] - stage._start_m)) < 0.3
    assert not find_walker(WalkSettings(), OPTIONS).walk(NONE, 4.0, 3).over


@pytest.fixture
def store(sweep_of, monkeypatch, tmp_path):
    """Return a function that runs an episode, and returns the store of its walker."""
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
def test_workers_share_the_store_that_their_walkers_use(store, monkeypatch, tmp_path, keeps):
    """A store lets one worker make a result while the others wait for it."""
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "cache"))
    found = store(EpisodeRun("ab12", keeps))
    assert isinstance(found, Store)
    assert found.folder == tmp_path / ("cache" if keeps else "scratch/store-ab12")


def test_a_cache_that_is_off_for_the_user_is_not_used_on_a_cluster_either(
    store, monkeypatch, tmp_path
):
    monkeypatch.setenv(cache.FOLDER, cache.OFF)
    sent = pickle.dumps(EpisodeRun.new())
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "cache"))  # the cluster's cache
    assert store(pickle.loads(sent)).folder.parent == tmp_path / "scratch"


def test_a_walker_whose_episode_failed_is_not_used_again(sweep_of, monkeypatch, tmp_path):
    """Its simulator may be closed; the next episode would fail for that reason alone."""
    closed = []

    def broken(*_):
        raise BackendError("the board did not start")

    walker = SimpleNamespace(walk=broken, close=lambda: closed.append(True))
    monkeypatch.setattr(episode, "find_walker", lambda *_: WALKERS.get("broken", lambda: walker))
    (point,) = sweep_of(varied={}).points()
    with pytest.raises(BackendError, match="the board did not start"):
        EpisodeRun("ab12", False)(point, str(tmp_path))
    assert (WALKERS.kept, closed) == (None, [True])
