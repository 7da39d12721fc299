"""Functions with a state are called in the steps of a run alone."""

from typing import Any

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.compile.loihi.known_sizes import sizes_known


class Counting:
    """A function that counts its calls."""

    def __init__(self) -> None:
        self.n_calls = 0

    def __call__(self, x: np.ndarray) -> np.ndarray:
        self.n_calls += 1
        return x


def to_whole(node: nengo.Node, ensemble: nengo.Ensemble, **options: Any) -> None:
    nengo.Connection(node, ensemble, **options)


def to_part(node: nengo.Node, ensemble: nengo.Ensemble, **options: Any) -> None:
    nengo.Connection(node, ensemble[[1, 0]], **options)


def through_a_node(node: nengo.Node, ensemble: nengo.Ensemble, **options: Any) -> None:
    hub = nengo.Node(size_in=2)
    nengo.Connection(node, hub, synapse=None, **options)
    nengo.Connection(hub, ensemble)


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("connect", [to_whole, to_part, through_a_node])
def test_a_function_is_called_once_a_step(connect: Any, pipeline: str) -> None:
    function = Counting()
    with nengo.Network(seed=1) as network:
        node, ensemble = nengo.Node(lambda t: [t, -t]), nengo.Ensemble(20, 2)
        connect(node, ensemble, function=function)
    function.n_calls = 0
    with spikeport.Simulator(network, pipeline=pipeline) as sim:
        sim.run_steps(5)
    assert function.n_calls == 5


def test_a_function_that_no_connection_has_is_called_for_its_size() -> None:
    with nengo.Network() as network:
        pre, post = nengo.Node([1.0, 2.0]), nengo.Node(size_in=3)
        wired = nengo.Connection(pre[0], post, function=lambda x: [*x, *x, *x])
        with sizes_known(network):
            other = nengo.Connection(pre, post[:2], function=lambda x: x)
            same = nengo.Connection(pre[1], post, function=wired.function)
    assert (other.size_mid, same.size_mid) == (2, 3)
