"""The filter that a connection asks of its target's compartments."""

import nengo
import numpy as np
import pytest

from spikeport.compile.ground.filters import (
    asked_filter_s,
    delay_s,
    keeps_constants,
    time_constant_s,
)


@pytest.fixture
def ends() -> tuple[nengo.Node, nengo.Ensemble, nengo.Ensemble]:
    with nengo.Network(add_to_container=False) as network:
        pair = nengo.Ensemble(4, 1), nengo.Ensemble(4, 1)
        node = nengo.Node([0])
    network.__enter__()
    yield node, *pair
    network.__exit__(None, None, None)


def test_connections_that_send_values_ask_for_nengo_loihis_filter_of_5_ms(ends) -> None:
    node, a, b = ends
    for pre, on_chip in ((node, False), (a, True), (a, False), (a.neurons, True)):
        transform = [[1] * pre.size_out]
        connection = nengo.Connection(pre, b, transform=transform, synapse=0.1)
        assert asked_filter_s(connection, on_chip) == 0.005


def test_connections_that_send_spikes_ask_for_the_filter_of_their_own_synapse(ends) -> None:
    node, a, b = ends
    assert asked_filter_s(nengo.Connection(a.neurons, b.neurons, synapse=0.1), True) == 0.1
    assert asked_filter_s(nengo.Connection(a.neurons, b.neurons, synapse=None), False) == 0
    weights = nengo.solvers.LstsqL2(weights=True)
    assert asked_filter_s(nengo.Connection(a, b, solver=weights, synapse=0.1), True) == 0.1
    into = nengo.Connection(node, b.neurons, transform=[[1]] * 4, synapse=0.1)
    assert asked_filter_s(into, False) == 0.005


def test_a_connection_without_a_synapse_has_a_time_constant_of_0(ends) -> None:
    _, a, b = ends
    assert time_constant_s(nengo.Connection(a, b, synapse=None)) == 0


@pytest.mark.parametrize(
    ("synapse", "late_s"),
    [
        (None, 0.0),
        (nengo.Lowpass(0.1), 0.1),
        (nengo.Alpha(0.1), 0.2),
        (nengo.Triangle(0.6), 0.2),
        (nengo.LinearFilter([0.1, 0], [0.1, 1]), None),  # passes no constant
        (nengo.LinearFilter([1], [1, 0], analog=False), None),
    ],
)
def test_the_delay_of_a_filter_is_the_lag_of_a_slow_ramp_behind_it(
    synapse: nengo.synapses.Synapse | None, late_s: float | None
) -> None:
    assert delay_s(synapse) == (late_s if late_s is None else pytest.approx(late_s))
    if synapse is not None and late_s is not None:
        ramp = 0.001 * np.arange(3000)[:, np.newaxis]
        (lag_s,) = (ramp - synapse.filt(ramp, dt=0.001, y0=0))[-1]
        assert lag_s == pytest.approx(late_s, abs=0.002)


def test_filters_that_are_not_known_to_pass_constants_do_not_count_as_such() -> None:
    assert all(map(keeps_constants, (None, nengo.Lowpass(1), nengo.Alpha(1), nengo.Triangle(1))))
    assert not keeps_constants(nengo.LinearFilter([2], [0.1, 1]))
