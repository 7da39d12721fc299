"""Coefficients of neurons in a time step, and parameters out of range."""

import numpy as np
import pytest

from spikeport.networks.loading.nir.dynamics import Dynamics, dynamics, own_shape
from spikeport.networks.loading.nir.graph import Node
from spikeport.reading.mismatch import MismatchError

DT_S = 1e-3


def node(kind: str, **values: object) -> Node:
    return Node("n", kind, {name: np.asarray(value, float) for name, value in values.items()})


def of_node(made: Node) -> Dynamics:
    return dynamics(made, own_shape(made) or (1,), DT_S)


CUBA = {"tau_syn": [4e-3, 2e-3], "tau_mem": [1e-2, 5e-3], "r": [10, 20], "v_leak": [0, 1]}


def test_a_current_based_neuron_has_both_decays():
    of = of_node(node("CubaLIF", **CUBA, v_threshold=[1, 2], v_reset=[-1, 0.5], w_in=3))
    np.testing.assert_allclose(of.current_decay, [0.25, 0.5])
    np.testing.assert_allclose(of.voltage_decay, [0.1, 0.2])
    np.testing.assert_allclose(of.gain, [0.25 * 3 * 0.1 * 10, 0.5 * 3 * 0.2 * 20])
    np.testing.assert_allclose(of.threshold, [2, 1.5])
    np.testing.assert_allclose(of.leak, [0.1 * 1, 0.2 * 0.5])


def test_other_kinds_of_neurons_have_the_coefficients_of_their_kind():
    lif = of_node(node("LIF", tau=[1e-2], r=[2], v_leak=[0], v_threshold=[1]))
    assert (lif.current_decay, lif.voltage_decay, lif.gain) == (1, pytest.approx(0.1), 0.2)
    fire = of_node(node("IF", r=np.full((2, 3), 2), v_threshold=np.ones((2, 3))))
    assert fire.shape == (2, 3)
    assert (fire.voltage_decay.max(), fire.gain.min(), fire.size) == (0, 2, 6)
    gate = of_node(node("Threshold", threshold=[0.5]))
    assert (gate.voltage_decay, gate.gain, gate.threshold) == (1, 1, 0.5)
    read = of_node(node("CubaLI", **CUBA))
    assert (read.threshold == np.inf).all()


THRESHOLDS = "expected thresholds of node n above its reset voltage, found threshold"


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (
            node("Threshold", threshold=[0.0]),
            f"{THRESHOLDS} 0, reset voltage 0",
        ),
        (node("IF", r=[1], v_threshold=[1], v_reset=[1]), f"{THRESHOLDS} 1, reset voltage 1"),
        (node("LIF", tau=[1e-4], r=[1], v_leak=[0], v_threshold=[1]),
         "expected tau of at least 0.001 s (one step of --dt) in node n, found 0.0001 s"),
        (node("LIF", tau=[0.0], r=[1], v_leak=[0], v_threshold=[1]),
         "expected tau above 0 in node n, found 0 s"),
        (node("CubaLIF", **CUBA | {"tau_mem": [1e-2, -1]}),
         "expected tau_mem above 0 in node n, found -1 s"),
        (node("CubaLIF", **CUBA | {"tau_syn": [9.0]}),
         "expected tau_syn from 0.001 s (one step of --dt) to 8192 steps in node n, found 9 s"),
        (node("IF", r=np.ones(3), v_threshold=np.ones(2)),
         "expected v_threshold for neurons (3,) in node n, found (2,)"),
        (node("IF", r=np.ones(0), v_threshold=np.ones(0)), "expected from 1 to 1,048,576 neurons"),
    ],
)  # fmt: skip
def test_parameters_out_of_range_are_refused(made, message):
    with pytest.raises(MismatchError) as caught:
        of_node(made)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("tau", "cure"), [(1e-4, "give another --dt"), (-1, "correct it in the graph: no --dt helps")]
)
def test_the_cure_for_a_time_constant_names_dt_only_where_it_helps(tau, cure):
    with pytest.raises(MismatchError) as caught:
        of_node(node("LIF", tau=[tau], r=[1], v_leak=[0], v_threshold=[1]))
    assert caught.value.cure == cure


def test_one_value_stands_for_all_neurons():
    made = node("LIF", tau=1e-2, r=[10.0], v_leak=0, v_threshold=[1.0])
    assert own_shape(made) == (1,)
    of = dynamics(made, (2, 3), DT_S)
    assert (of.shape, of.gain.tolist()) == ((2, 3), [1.0] * 6)
    assert own_shape(node("LIF", tau=1e-2, r=1, v_leak=0, v_threshold=np.ones(4))) == (4,)


def test_a_parameter_of_a_channel_holds_for_all_its_neurons():
    made = node("IF", r=1, v_threshold=np.reshape([0.5, 0.7], (2, 1, 1)))
    of = dynamics(made, (2, 1, 3), DT_S)
    assert of.threshold.tolist() == [0.5] * 3 + [0.7] * 3


def test_a_time_constant_of_a_voltage_has_no_upper_limit():
    found = of_node(node("LIF", tau=[1e6], r=[1e9], v_leak=[0], v_threshold=[1]))
    assert (found.voltage_decay, found.gain) == (pytest.approx(1e-9), pytest.approx(1))
