"""Errors that are sent to parts of learning rules, against errors that are sent as a whole."""

import nengo
import numpy as np
import pytest
from nengo_loihi.builder import connection as builder

from spikeport import Simulator
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.loihi.error_parts import error_parts_placed

ERROR = (0.4, -0.1, 0.2)


def learning(teach):
    """Return a network that learns three values from the errors that ``teach`` sends."""
    with nengo.Network(seed=1) as network:
        source, out = nengo.Node([0.5, -0.5]), nengo.Node(size_in=3)
        # With seeds of their own: Nengo's depend on how many nodes send errors.
        pre = nengo.Ensemble(60, 2, seed=2)
        nengo.Connection(source, pre, seed=3)
        learned = nengo.Connection(
            pre, out, function=lambda x: [0, 0, 0], learning_rule_type=nengo.PES(2e-4), seed=4
        )
        teach(learned.learning_rule)
        network.probe = nengo.Probe(out)
    return network


def send(values, part, **options):
    nengo.Connection(nengo.Node(values), part, **options)


def one_by_one(rule):
    for i, value in enumerate(ERROR):
        send(value, rule[i])


def in_two_parts(rule):
    send(ERROR[1:], rule[1:])
    send(ERROR[0] / 2, rule[:1], transform=2)


def in_reverse(rule):
    send(ERROR[::-1], rule[::-1])


def by_indices(rule):
    send([ERROR[2], ERROR[0]], rule[[2, 0]], function=lambda x: x)
    send(ERROR[1], rule[-2])


def learned(network, **options):
    with Simulator(network, **options) as sim:
        sim.run_steps(200)
        return sim.data[network.probe]


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("teach", [one_by_one, in_two_parts, in_reverse, by_indices])
def test_errors_sent_in_parts_teach_as_the_whole_error(teach, pipeline):
    wanted = learned(learning(lambda rule: send(ERROR, rule)), pipeline=pipeline)
    assert np.linalg.norm(wanted[-1]) > 0
    np.testing.assert_array_equal(learned(learning(teach), pipeline=pipeline), wanted)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_values_without_an_error_stay_on_both_emulators():
    network = learning(lambda rule: send(0.5, rule[1]))
    values = learned(network)
    np.testing.assert_array_equal(learned(network, backend="nengo-loihi"), values)
    assert values[-1][1] < 0
    assert abs(values[-1][[0, 2]]).max() < abs(values[-1][1]) / 4


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_sparse_transform_is_refused_for_a_part_as_for_the_whole():
    sparse = nengo.Sparse((1, 1), init=[1], indices=[[0, 0]])
    for of in (lambda rule: rule[1], lambda rule: rule[:1]):
        network = learning(lambda rule, of=of: send(0.5, of(rule), transform=sparse))
        with pytest.raises(RefusedError, match="does not yet support 'Sparse'"):
            learned(network)


def test_nothing_of_nengo_loihi_stays_patched():
    usual = builder.build_host_to_learning_rule
    with error_parts_placed():
        assert builder.build_host_to_learning_rule is not usual
    assert builder.build_host_to_learning_rule is usual
