"""Hints on loops between chip and host: the path that is named, and its delay."""

import itertools
from typing import Any

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.compile.check.host_loops import NAMED, host_loop_hints
from tests.helpers.small_networks import scope_of

KINDS = (nengo.Simulator, spikeport.Simulator)


def hints(network: nengo.Network, dt_s: float = 0.001) -> list[tuple[str, str]]:
    return [(one.object, one.used) for one in host_loop_hints(scope_of(network), dt_s)]


def loop(there: Any = 0.005, back: Any = 0.005, gain: float = -0.5) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(200, 1, label="a")
        robot = nengo.Node(lambda t, x: gain * x, size_in=1, label="robot")
        nengo.Connection(a, robot, synapse=there)
        nengo.Connection(robot, a, synapse=back)
        nengo.Connection(nengo.Node(0.6, label="input"), a, transform=1 - gain)
        nengo.Probe(a, synapse=0.01)
    return network


def test_a_loop_is_named_once_with_its_delay() -> None:
    assert hints(loop()) == [("robot -> a -> robot", "10 ms became about 18 ms")]
    assert hints(loop(back=None), dt_s=0.0001) == [
        ("robot -> a -> robot", "5 ms became about 10.3 ms")
    ]


def test_slow_loops_and_loops_within_chip_or_host_get_no_hint() -> None:
    assert hints(loop(there=0.1, back=0.1)) == []
    with nengo.Network() as network:
        a = nengo.Ensemble(20, 1)
        middle = nengo.Node(size_in=1)
        nengo.Connection(a, middle)
        nengo.Connection(middle, a)
        node, other = (nengo.Node(lambda t, x: x, size_in=1) for _ in range(2))
        nengo.Connection(node, other)
        nengo.Connection(other, node)
        nengo.Connection(node, a)
    assert hints(network) == []


def test_the_fastest_of_several_paths_around_a_loop_is_named() -> None:
    network = loop(there=0.1)
    a, robot = network.ensembles[0], network.nodes[0]
    with network:
        middle = nengo.Node(size_in=1, label="middle")
        nengo.Connection(a, middle, synapse=0.02)
        nengo.Connection(middle, robot, synapse=None)
        nengo.Connection(middle, a, synapse=None)
    assert hints(network) == [("robot -> a -> middle -> robot", "25 ms became about 33 ms")]


def test_the_fastest_of_several_loops_is_named() -> None:
    network = loop(there=0.1, back=0.1)
    with network:
        b = nengo.Ensemble(20, 1, label="b")
        nengo.Connection(b, network.nodes[0], synapse=0.005)
        nengo.Connection(network.nodes[0], b, synapse=0.005)
    assert hints(network) == [("robot -> b -> robot", "10 ms became about 18 ms")]


def test_a_long_loop_is_named_by_its_first_and_last_objects() -> None:
    network = loop(there=None)
    (a,), robot = network.ensembles, network.nodes[0]
    network.connections[:] = network.connections[1:]
    with network:
        chain = [a, *(nengo.Ensemble(5, 1, label=f"{i}") for i in range(NAMED)), robot]
        for pre, post in itertools.pairwise(chain):
            nengo.Connection(pre, post, synapse=None)
    assert hints(network)[0][0] == "robot -> a -> 0 -> 3 more -> 4 -> 5 -> robot"


def test_an_error_connection_to_a_learning_rule_closes_no_loop() -> None:
    with nengo.Network() as network:
        a, error = nengo.Ensemble(20, 1), nengo.Node(lambda t, x: x, size_in=1)
        learned = nengo.Connection(a, error, learning_rule_type=nengo.PES())
        nengo.Connection(error, learned.learning_rule)
    assert hints(network) == []


def rise_ms(network: nengo.Network, kind: Any) -> int:
    """Return the steps until two thirds of the steady value are reached."""
    with kind(network, progress_bar=False) as simulator:
        simulator.run_steps(1200)
        values = simulator.data[network.probes[0]][:, 0]
        return int(np.argmax(values > values[-200:].mean() * 2 / 3))


@pytest.mark.slow
def test_shorter_synapses_make_up_for_the_delay() -> None:
    wanted, late = (rise_ms(loop(0.01, 0.01, 0.8), kind) for kind in KINDS)
    mended = rise_ms(loop(0.01, 0.002, 0.8), spikeport.Simulator)
    assert late > 1.25 * wanted
    assert abs(mended - wanted) < 0.5 * (late - wanted)


def test_other_filters_count_by_their_delay_and_unknown_delays_get_no_hint() -> None:
    assert hints(loop(nengo.Triangle(0.6), None)) == []  # 200 ms
    assert hints(loop(nengo.Triangle(0.03), None)) == [
        ("robot -> a -> robot", "10 ms became about 18 ms")
    ]
    assert hints(loop(nengo.Alpha(0.01), None)) == [
        ("robot -> a -> robot", "20 ms became about 28 ms")
    ]
    assert hints(loop(None, None)) == [("robot -> a -> robot", "0 ms became about 8 ms")]
    assert hints(loop(nengo.LinearFilter([0.1, 0], [0.1, 1]), None)) == []
