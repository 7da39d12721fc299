"""The queue of points: a worker that has a network gets the points of this network."""

import pytest

from spikeport.experiments.sweep.queue import Queue


@pytest.fixture
def queue(sweep_of):
    """Return two networks, of 2 and of 20 neurons a unit, each on three paths."""
    varied = {"n_neurons": (2, 20), "path": ("paper", "line", "s-curve")}
    sweep = sweep_of(varied=varied, settings={"network_seed": 0})
    return Queue(sweep.points())


def taken(queue, network=None):
    point = queue.take(network)
    return point.network, (point.place["n_neurons"], point.place["path"])


def test_a_worker_with_a_network_gets_its_points_before_those_of_another(queue):
    first, place = taken(queue)
    assert place == (2, "paper")
    assert [taken(queue, first)[1] for _ in range(2)] == [(2, "line"), (2, "s-curve")]
    other, place = taken(queue, first)
    assert other != first
    assert place == (20, "paper")


def test_new_workers_begin_new_networks_and_then_help_where_most_points_wait(queue):
    first, second = taken(queue)[0], taken(queue)[0]
    assert second != first
    assert taken(queue, second)[1] == (20, "line")
    assert taken(queue)[1] == (2, "line")


def test_a_point_that_is_put_back_waits_behind_the_others_of_its_network(queue):
    point = queue.take(None)
    queue.put(point)
    left = []
    while queue:
        left.append(queue.take(point.network))
    assert left[2] == point
    assert len(left) == 6
