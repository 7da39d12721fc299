"""Faster parts of nengo-loihi's builder, whose results are the same bit for bit."""

from typing import Any

import nengo
import numpy as np
import pytest
from nengo.solvers import NoSolver
from nengo_loihi.builder import connection, ensemble
from nengo_loihi.decode_neurons import OnOffDecodeNeurons
from nengo_loihi.neurons import discretize_tau_rc, discretize_tau_ref, loihi_lif_rates

import spikeport
from spikeport.compile.loihi.quick_builder import lif_rates, quick_builder, random_state
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.errors import CompileError
from tests.helpers.small_networks import rewrite_of

DT_S = 1e-3


@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1])
def test_a_random_generator_draws_the_numbers_of_numpys(seed: int) -> None:
    ours, numpys = random_state(seed), np.random.RandomState(seed)
    # the second normal number is kept from the first draw
    for draw in ("randn", "uniform", "randn", "permutation"):
        args = (700,) if draw == "permutation" else ()
        np.testing.assert_array_equal(getattr(ours, draw)(*args), getattr(numpys, draw)(*args))


class Given(nengo.LIF):
    """Neurons whose values are j itself, the current above the threshold."""

    def current(self, x: np.ndarray, gain: Any, bias: Any) -> Any:
        class Current:
            def __sub__(self, _one: float) -> np.ndarray:
                return x

        return Current()


@pytest.mark.parametrize(
    ("tau_rc", "tau_ref", "dt"),
    [
        (0.02, 0.002, 1e-3),
        (0.05, 0.001, 1e-3),
        (0.002, 0.0, 1e-3),
        (0.02, 0.003, 1e-4),
        (10.0, 0.002, 1e-3),  # its decay is 0 on the chip: an infinite time constant
        (1e-4, 0.002, 1e-3),  # its time constant is 0 on the chip
    ],
)
def test_rates_equal_nengo_loihis_even_where_periods_are_whole_steps(
    tau_rc: float, tau_ref: float, dt: float
) -> None:
    kind, rng = Given(tau_rc=tau_rc, tau_ref=tau_ref), np.random.RandomState(0)
    whole_s = np.arange(1000) * dt - discretize_tau_ref(tau_ref, dt)
    with np.errstate(all="ignore"):
        j = 1 / np.expm1(whole_s / discretize_tau_rc(tau_rc, dt))
    j = j[np.isfinite(j) & (j > 1e-16)]
    near = [j + shift * np.spacing(j) for shift in range(-4, 5)]
    drawn = 10 ** rng.uniform(-16, 3, 50_000)
    values = np.concatenate((*near, drawn, -drawn, [0.0, np.inf, -np.inf, np.nan]))[:, np.newaxis]
    with np.errstate(all="ignore"):
        usual = loihi_lif_rates(kind, values, None, None, dt)
        found = lif_rates(kind, values.copy(), None, None, dt)
    # nengo-loihi's are infinite where an endless current takes 0 steps.
    np.testing.assert_array_equal(found, np.where(np.isinf(usual), 1 / dt, usual))
    assert (usual == 0).any()


def test_neurons_spike_at_most_once_a_step() -> None:
    x = np.array([[0.5], [1.0]])
    rates = lif_rates(nengo.LIF(tau_ref=0.002, tau_rc=0.02), x, np.ones(1) * 3, np.ones(1), 1.0)
    np.testing.assert_array_equal(rates, [[1.0], [1.0]])


def test_rates_of_many_neurons_equal_nengo_loihis() -> None:
    rng = np.random.RandomState(0)
    x, gain, bias = rng.uniform(-1, 1, (999, 77)), rng.uniform(1, 20, 77), rng.uniform(-9, 9, 77)
    usual = loihi_lif_rates(nengo.LIF(), x, gain, bias, DT_S)
    np.testing.assert_array_equal(lif_rates(nengo.LIF(), x.copy(), gain, bias, DT_S), usual)
    doubled = lif_rates(nengo.LIF(), x, gain, bias, DT_S, amplitude=2)
    np.testing.assert_array_equal(doubled, 2 * usual)


@pytest.mark.parametrize(("firing", "computed"), [(0, [32]), (40, [32, 50])])
def test_known_decoders_need_rates_until_a_neuron_fires(
    firing: int, computed: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[int] = []

    def rates(kind: Any, x: np.ndarray, *arguments: Any) -> np.ndarray:
        found.append(len(x))
        return usual(kind, x, *arguments)

    usual = connection.loihi_rates
    monkeypatch.setattr(connection, "loihi_rates", rates)
    points, decoders = np.zeros((50, 1)), np.arange(3.0).reshape(3, 1)
    points[firing] = 1
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(3, 1, gain=np.full(3, 2.0), bias=np.zeros(3), encoders=np.ones((3, 1)))
        b = nengo.Ensemble(3, 1)
        made = nengo.Connection(a, b, eval_points=points, solver=NoSolver(decoders))
    solver = ParameterSolver(rewrite_of(network), DT_S)
    built = solver.decoded(made)
    np.testing.assert_array_equal(built.weights, decoders.T)
    np.testing.assert_array_equal(built.eval_points, points)
    assert found == computed


def test_known_decoders_of_neurons_that_never_fire_are_refused() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(3, 1, gain=np.ones(3), bias=np.zeros(3), encoders=np.ones((3, 1)))
        b = nengo.Ensemble(3, 1)
        made = nengo.Connection(a, b, eval_points=np.zeros((50, 1)), solver=NoSolver())
    with pytest.raises(CompileError, match="'activities' matrix is all zero"):
        ParameterSolver(rewrite_of(network), DT_S).decoded(made)


def test_the_builders_own_parts_are_restored_at_the_end() -> None:
    modules, solve = (ensemble, connection), connection.solve_for_decoders
    with quick_builder():
        assert all(module.np.random.RandomState is random_state for module in modules)
        assert all(module.np.zeros is np.zeros for module in modules)
        assert connection.solve_for_decoders is not solve
    assert all(module.np is np for module in modules)
    assert connection.solve_for_decoders is solve


@pytest.mark.parametrize("amplitude", [0.5, 2.0])
@pytest.mark.parametrize("base", [nengo.LIFRate(), nengo.RectifiedLinear()], ids=repr)
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_regular_spikes_of_any_amplitude_decode_to_the_values_of_float_nengo(
    pipeline: str, base: nengo.neurons.NeuronType, amplitude: float
) -> None:
    with nengo.Network(seed=1) as network:
        kind = nengo.RegularSpiking(base, amplitude=amplitude)
        a, b = nengo.Ensemble(60, 1, neuron_type=kind), nengo.Ensemble(60, 1, radius=2)
        nengo.Connection(nengo.Node(0.5), a)
        nengo.Connection(a, b)
        probes = [nengo.Probe(one, synapse=0.05) for one in (a, b)]
    found = []
    for options in ({"backend": "reference"}, {"pipeline": pipeline}):
        with spikeport.Simulator(network, progress_bar=False, **options) as sim:
            sim.run(0.4)
            found.append([sim.data[probe][-150:].mean() for probe in probes])
    assert found[0][0] == pytest.approx(amplitude / 2, rel=0.05)
    assert found[1] == pytest.approx(found[0], rel=0.12)


def test_neurons_of_the_host_that_nobody_decodes_get_one_evaluation_point() -> None:
    kind = OnOffDecodeNeurons(is_input=True)
    with nengo.Network(seed=1) as network:
        usual = kind.get_ensemble(3)
        with quick_builder():
            quick = kind.get_ensemble(3)
    with nengo.Simulator(network, progress_bar=False) as simulator:
        wanted, found = simulator.data[usual], simulator.data[quick]
    assert len(wanted.eval_points) > 1
    assert len(found.eval_points) == 1
    for name in ("gain", "bias", "encoders", "intercepts", "max_rates"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
