"""Spikeport's own neuron types, compared with their equations."""

import nengo
import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.neurons import (
    MOST_HELD_STEPS,
    IntegrateAndFire,
    LeakyIntegrator,
    SpikeSource,
    chip_decays,
    weight_step,
)

DT_S = 1e-3


def stepped(kind: nengo.neurons.NeuronType, charges: list[float], n: int = 1) -> np.ndarray:
    """Return the outputs of n neurons for charges, one each step."""
    state, rows = kind.make_state(n), []
    for charge in charges:
        output = np.zeros(n)
        kind.step(DT_S, np.full(n, charge / DT_S), output, **state)
        rows.append(output)
    return np.array(rows)


def test_the_voltage_of_a_leaky_integrator_adds_up_its_decaying_current():
    kind = LeakyIntegrator(current_decay=0.5, voltage_decay=0.25, leak=1.0)
    #     u: 8, 4, 2       v: 8 + 1, 9 - 2.25 + 4 + 1, 11.75 - 2.9375 + 2 + 1
    np.testing.assert_allclose(stepped(kind, [8, 0, 0])[:, 0], [9, 11.75, 11.8125])


def test_neurons_spike_above_the_threshold_and_restart_from_zero():
    spikes = stepped(IntegrateAndFire(threshold=2.0), [1, 1, 0.5, -4, 5, 2])[:, 0] * DT_S
    np.testing.assert_array_equal(spikes, [0, 0, 1, 0, 0, 1])


def test_parameters_may_differ_between_neurons():
    kind = IntegrateAndFire(np.array([1.0, 3.0]), voltage_decay=np.array([0.0, 1.0]))
    np.testing.assert_array_equal(stepped(kind, [2, 2], n=2) * DT_S, [[1, 0], [1, 0]])
    assert kind == IntegrateAndFire(np.array([1.0, 3.0]), voltage_decay=np.array([0.0, 1.0]))
    assert kind != IntegrateAndFire(np.array([1.0, 3.0]))


@pytest.mark.parametrize(
    ("decays", "charge"), [((1.0, 0.0), 0.3), ((0.5, 0.1), 0.2), ((1.0, 0.1), 0.05), ((1, 0.2), 3)]
)
def test_rates_match_the_mean_output_for_constant_input(decays, charge):
    kind = IntegrateAndFire(1.0, *decays)
    x = np.array([charge / DT_S])
    (rate,) = kind.rates(x, np.ones(1), np.zeros(1))[0]
    late = stepped(kind, [charge] * 2000)[1000:]
    assert rate == pytest.approx(late.mean(), rel=0.02)


@pytest.mark.parametrize(
    ("threshold", "decay", "charge", "period"),
    # Voltages reach the threshold in the first or second step, and exceed it in the next.
    [(1, 0, 1, 2), (2, 0, 1, 3), (1.5, 0.5, 1, 3), (1, 1, 2, 1)],
)
def test_rates_count_the_step_after_a_voltage_that_equals_the_threshold(
    threshold, decay, charge, period
):
    kind = IntegrateAndFire(threshold, voltage_decay=decay)
    assert np.diff(np.flatnonzero(stepped(kind, [charge] * 20)[:, 0])).tolist()[0] == period
    (rate,) = kind.rates(np.array([charge / DT_S]), np.ones(1), np.zeros(1))[0]
    assert rate == pytest.approx(1 / (period * DT_S))


def test_rates_of_leaky_integrators_are_their_final_voltages():
    kind = LeakyIntegrator(0.5, 0.25, leak=0.125)
    (voltage,) = kind.rates(np.array([0.1 / DT_S]), np.ones(1), np.zeros(1))[0]
    assert voltage == pytest.approx(stepped(kind, [0.1] * 200)[-1, 0])


def test_sources_spike_above_one_half_after_a_wait():
    kind = SpikeSource(wait=2)
    state, found = kind.make_state(1), []
    for value in (1, 1, 0.4, 1, 0.6):
        output = np.zeros(1)
        kind.step(DT_S, np.array([value]), output, **state)
        found.append(output[0] * DT_S)
    assert found == [0, 0, 0, 1, 1]
    rates = kind.rates(np.array([[0.0, 1.0]]), np.ones(2), np.zeros(2))
    assert rates.tolist() == [[0, 1 / DT_S]]


def test_chip_decays_are_rounded_to_12_bits_and_those_of_currents_are_above_0():
    current, voltage = chip_decays(np.array([1.0, 0.1, 1e-6]), np.array([1.0, 1 / 8192, 1e-4]))
    assert current.tolist() == [4096, 410, 1]
    assert voltage.tolist() == [4095, 1, 0]


def test_the_step_of_weights_is_the_least_that_can_represent_the_largest_weight():
    assert [weight_step(largest) for largest in (0, 127 * 64, 127 * 64 + 1, 2.0**20)] == [
        64, 64, 128, 2**14,
    ]  # fmt: skip


def test_sources_spike_late_and_only_for_a_number_of_steps():
    kind = SpikeSource(late=2, wait=1, n_steps=3)
    values = [1, 1, 0, 1, 1, 1]
    found = stepped(kind, [DT_S * value for value in values])[:, 0] * DT_S
    np.testing.assert_array_equal(found, [0, 0, 1, 1, 0, 0])
    latest = stepped(SpikeSource(late=MOST_HELD_STEPS), [DT_S] + 59 * [0.0])[:, 0] * DT_S
    assert np.flatnonzero(latest).tolist() == [52]


@pytest.mark.parametrize(
    ("kind", "arguments", "message"),
    [
        (
            IntegrateAndFire,
            {"threshold": 0},
            "threshold: 0 is out of range; it is above 0, up to inf",
        ),
        (LeakyIntegrator, {"current_decay": 0}, "0 is out of range; it is above 0, up to 1$"),
        (LeakyIntegrator, {"voltage_decay": [0, 1.5]}, "1.5 is out of range; it goes from 0 to 1"),
        (IntegrateAndFire, {"leak": np.nan}, "leak: nan is out of range"),
    ],
)
def test_parameters_out_of_range_are_refused(kind, arguments, message):
    with pytest.raises(UsageError, match=message):
        kind(**arguments)
