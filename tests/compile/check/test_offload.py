"""Ensembles that are moved to the host, the reasons, and the settings that are restored."""

from pathlib import Path

import nengo
import nengo_loihi
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.compile.check.offload import Offload, on_host, problems
from spikeport.compile.check.violation import DoesNotFitError, NothingOnChipError, Violation
from spikeport.compile.ground.identity import identity
from spikeport.compile.ground.refusal import RefusedError, concerning
from spikeport.compile.pipeline import compile_network
from tests.helpers.chip_files import chip_file


def moved(
    network: nengo.Network, passes: str | None = None, chip: Path | str = "loihi"
) -> list[tuple[str, str, str, int]]:
    report = compile_network(network, chip, pipeline=passes, offload=True).report
    return [(one.object, one.id, one.violator, one.host_spikes) for one in report.offloaded]


def mixed() -> nengo.Network:
    """Return a network with neurons, noise and a filter that the chip does not have."""
    with nengo.Network(seed=1) as network:
        u = nengo.Node([0.5])
        good, rate, noisy, late = (nengo.Ensemble(n, 1, label=str(n)) for n in (50, 30, 10, 40))
        rate.neuron_type = nengo.RectifiedLinear()
        noisy.noise = nengo.processes.WhiteNoise()
        nengo.Connection(u, good)
        nengo.Connection(rate, good)
        nengo.Connection(noisy.neurons, good.neurons, transform=np.full((50, 10), 1e-4))
        nengo.Connection(good, late, synapse=nengo.Alpha(0.01))
        network.p = nengo.Probe(late, synapse=0.01)
    return network


@pytest.mark.parametrize("passes", ["as_written", "compact"])
def test_ensembles_that_break_rules_are_moved_fewest_neurons_first(passes: str) -> None:
    assert moved(mixed(), passes) == [
        ("10", "SP003", "10", 10),
        ("30", "SP002", "30", 2),
        ("40", "SP005", "50 -> 40", 0),
    ]


@pytest.mark.slow
def test_members_of_a_fused_ensemble_can_be_moved(tmp_path: Path) -> None:
    chip = chip_file(tmp_path / "small.toml", compartments=50)
    with nengo.Network(seed=1) as network:
        array, b = nengo.networks.EnsembleArray(60, 2, label="array"), nengo.Ensemble(20, 1)
        nengo.Connection(nengo.Node([0.3, 0.4]), array.input)
        nengo.Connection(array.output, b, transform=[[1, 1]])
    passes = "fuse,merge_axons,pack"
    with pytest.raises(DoesNotFitError, match=r"array_0 \.\. .*array_1: SP103 "):
        compile_network(network, chip, pipeline=passes)
    report = compile_network(network, chip, pipeline=passes, offload=True).report
    assert [one.object for one in report.offloaded] == ["array.array_0", "array.array_1"]


@pytest.mark.parametrize("passes", ["as_written", "compact", "split_ensembles{max_neurons=6},fuse"])
def test_members_and_owners_of_ensembles_that_the_builder_refuses_can_be_moved(passes: str) -> None:
    with nengo.Network(seed=1) as network:
        u = nengo.Node(np.sin)
        # No scale of weights fits both gains.
        gain, bias = np.r_[np.full(9, 1e-6), 1e7], np.r_[np.full(9, 2.0), 1e7]
        bad = nengo.Ensemble(10, 1, label="bad", gain=gain, bias=bias)
        nengo.Connection(u, bad)
        nengo.Connection(u, nengo.Ensemble(12, 2, label="good")[0])
    assert [name for name, *_ in moved(network, passes)] == ["bad"]


@pytest.mark.parametrize("passes", ["as_written", "compact", "constant_inputs,compact"])
def test_ends_of_connections_that_passes_make_can_be_moved(passes: str) -> None:
    with nengo.Network(seed=1) as network:
        source, through = nengo.Ensemble(20, 1, label="source"), nengo.Node(size_in=1)
        nengo.Connection(nengo.Node([0.6]), source)
        nengo.Connection(source, through, synapse=nengo.Alpha(0.01))
        for _ in range(2):
            nengo.Connection(through, nengo.Ensemble(30, 1), synapse=None)
    assert [name for name, *_ in moved(network, passes)] == ["source"]


def test_the_simulator_runs_an_offloaded_network_and_leaves_it_unchanged() -> None:
    network = mixed()
    with Simulator(network, offload=True) as sim, Simulator(network, backend="reference") as ref:
        for one in (sim, ref):
            one.run(0.3)
        assert [one["object"] for one in sim.report()["offloaded"]] == ["10", "30", "40"]
        error = np.abs(sim.data[network.p] - ref.data[network.p])[100:].mean()
    assert error < 0.2 * np.abs(ref.data[network.p][100:]).mean()
    with pytest.raises(DoesNotFitError):
        compile_network(network)


def test_the_end_of_a_connection_whose_move_solves_the_problem_is_moved() -> None:
    with nengo.Network(seed=1) as network:
        small, large = nengo.Ensemble(5, 1, label="small"), nengo.Ensemble(50, 2, label="large")
        nengo.Connection(small, large, transform=[[1], [0]], synapse=nengo.Alpha(0.01))
        transform = nengo.Sparse((2, 2), indices=[[0, 0]], init=[1.0])
        nengo.Connection(nengo.Node([1, 1]), large, transform=transform)
        nengo.Ensemble(60, 1)
    assert [one[:3] for one in moved(network)] == [
        ("small", "SP005", "small -> large"),
        ("large", "", "nodes[0] -> large"),
    ]


def test_a_move_that_leaves_the_rule_broken_at_another_end_is_undone(tmp_path: Path) -> None:
    chip = chip_file(tmp_path / "few_axons.toml", in_axons=200)
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(250, 1, label="a"), nengo.Ensemble(100, 1, label="b")
        nengo.Connection(a, b)
        nengo.Probe(nengo.Ensemble(50, 1, label="c"))
    assert [one[:2] for one in moved(network, "", chip)] == [("a", "SP102")]


def test_sources_that_break_a_rule_one_by_one_are_moved_in_place_of_a_large_target() -> None:
    with nengo.Network(seed=1) as network:
        target = nengo.Ensemble(400, 1, label="target")
        for number in range(3):
            source = nengo.Ensemble(10, 1, label=f"source {number}")
            nengo.Connection(source, target, synapse=nengo.Alpha(0.01))
    assert [one[0] for one in moved(network)] == ["source 0", "source 1", "source 2"]


def test_an_ensemble_with_the_name_of_the_chip_is_not_taken_for_it() -> None:
    error = DoesNotFitError("loihi", [Violation("SP201", "cores", "loihi", "3", "2", "")])
    assert [problem.about for problem in problems(error)] == [()]


def test_host_spikes_are_counted_for_each_connection_that_enters_the_chip() -> None:
    with nengo.Network(seed=1) as network:
        rate = nengo.Ensemble(9, 2, label="rate", neuron_type=nengo.LIFRate())
        through = nengo.Node(size_in=2)
        nengo.Connection(rate, through)
        for _ in range(2):
            nengo.Connection(through, nengo.Ensemble(5, 2))
    assert moved(network) == [("rate", "SP002", "rate", 2 * 2 * 2)]


def test_an_ensemble_that_is_moved_to_the_host_still_learns() -> None:
    with nengo.Network(seed=1) as network:
        pre = nengo.Ensemble(60, 1, label="pre", noise=nengo.processes.WhiteNoise(seed=1))
        chip = nengo.Ensemble(50, 1)
        target, error = nengo.Node(size_in=1), nengo.Node(size_in=1)
        for ensemble in (pre, chip):
            nengo.Connection(nengo.Node([0.6]), ensemble)
        rule = nengo.PES(1e-3)
        learned = nengo.Connection(pre, target, function=lambda x: 0, learning_rule_type=rule)
        nengo.Connection(target, error)
        nengo.Connection(chip, error, transform=-1)
        nengo.Connection(error, learned.learning_rule)
        network.p = nengo.Probe(target, synapse=0.02)
    with Simulator(network, offload=True) as sim:
        sim.run(1.0)
    assert sim.data[network.p][:20].mean() < 0.3
    assert sim.data[network.p][-200:].mean() == pytest.approx(0.6, abs=0.1)


@pytest.mark.slow
def test_an_ensemble_that_exceeds_a_limit_of_a_core_is_moved() -> None:
    with nengo.Network(seed=1) as network:
        with nengo.Network() as network.inner:
            big = nengo.Ensemble(5000, 1, n_eval_points=50, label="big")
        nengo.Connection(big, nengo.Node(lambda t, x: None, size_in=1))
        nengo.Ensemble(5, 1)
    found = moved(network, "")
    assert [one[:2] for one in found] == [("networks[0].big", "SP102")]


def test_the_error_for_an_empty_chip_lists_the_moved_ensembles() -> None:
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(5, 1, label="a", neuron_type=nengo.Izhikevich())
    with pytest.raises(NothingOnChipError) as raised:
        compile_network(network, offload=True)
    assert str(raised.value) == (
        "no ensemble of the network is on the chip (1 moved): all of it "
        "runs on the host, in float Nengo; there is no image\n"
        "a (5 neurons) to the host: SP002 neuron type of a; adds at most 0 host spikes a step"
    )
    assert len(raised.value.offloaded) == 1


def test_a_refusal_that_names_no_ensemble_is_raised_unchanged() -> None:
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(5, 1)
    refusal = DoesNotFitError("loihi", [Violation("SP201", "cores", "loihi", "130", "128", "")])

    def attempt() -> None:
        raise refusal

    with pytest.raises(DoesNotFitError) as raised:
        Offload(network, attempt).result()
    assert raised.value is refusal


def test_a_move_that_does_not_solve_its_problem_is_undone() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(5, 1, label="a"), nengo.Ensemble(6, 1, label="b")
        nengo.Connection(a, b)

    def attempt() -> str:
        if network.config[b].on_chip is not False:
            raise concerning(("a -> b", "a", "b"), RefusedError("no"))
        return "done"

    search = Offload(network, attempt)
    assert search.result() == "done"
    assert [move.ensemble for move in search.moves] == [b]


def test_all_ensembles_of_a_problem_are_moved_if_no_single_move_solves_it() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(9, 1, label="a"), nengo.Ensemble(5, 1, label="b")
        nengo.Connection(a, b)

    def attempt() -> str:
        if any(network.config[one].on_chip is not False for one in (a, b)):
            raise concerning(("a -> b", "a", "b"), RefusedError("no"))
        return "done"

    search = Offload(network, attempt)
    assert search.result() == "done"
    assert [move.ensemble for move in search.moves] == [a, b]


def test_settings_are_restored_after_an_error() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(5, 1), nengo.Ensemble(5, 1)
    nengo_loihi.add_params(network)
    network.config[a].on_chip = True

    def fail() -> None:
        with on_host(network, [a, b]):
            assert network.config[b].on_chip is False
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert network.config[a].on_chip is True
    assert "on_chip" not in network.config[b]


def test_offloading_leaves_the_identity_of_a_network_with_settings_unchanged() -> None:
    network = mixed()
    nengo_loihi.add_params(network)
    before = identity(network)
    compile_network(network, offload=True)
    assert identity(network) == before


def test_keeping_an_ensemble_on_the_host_leaves_no_settings_in_the_network() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(5, 1)
    before = identity(network)
    with on_host(network, [a]):
        assert network.config[a].on_chip is False
    assert identity(network) == before


def test_a_refusal_without_a_rule_is_one_problem() -> None:
    refusal = concerning(("a -> b", "a"), RefusedError("no"))
    assert problems(refusal) == [("", "refusal by nengo-loihi", "a -> b", ("a -> b", "a"))]


def test_each_violation_is_a_problem() -> None:
    assert [one.object for one in problems(_refusal(mixed()))] == ["30", "10", "50 -> 40"]


def _refusal(network: nengo.Network) -> RefusedError:
    with pytest.raises(RefusedError) as raised:
        compile_network(network)
    return raised.value


def test_ensembles_whose_move_has_no_alternative_are_moved_in_one_attempt() -> None:
    """Each attempt checks all rules, and a network may break a rule in every ensemble."""
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(5, 1, label="stays")
        for i in range(9):
            nengo.Ensemble(20 - i, 1, neuron_type=nengo.Tanh(), label=f"moves {i}")
    attempts = []

    def attempt() -> None:
        attempts.append(1)
        compile_network(network)

    search = Offload(network, attempt)
    search.result()
    assert len(attempts) == 2
    assert [move.ensemble.n_neurons for move in search.moves] == [*range(12, 21)]


def test_an_ensemble_that_the_host_refuses_too_is_not_moved_for_another_rule() -> None:
    with nengo.Network(seed=1) as network:
        stuck, moved = nengo.Ensemble(5, 1, gain=np.ones(5)), nengo.Ensemble(6, 1)
        for ensemble in (stuck, moved):
            nengo.Probe(ensemble.neurons, "refractory_time")
    with pytest.raises(DoesNotFitError, match="SP004"):
        compile_network(network, offload=True)


def test_neurons_that_moved_rate_neurons_feed_are_moved_too() -> None:
    alike = {"gain": np.ones(2), "bias": [80.0, 60.0], "encoders": np.ones((2, 1))}
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(2, 1, label="a", neuron_type=nengo.RectifiedLinear(), **alike)
        alike = {**alike, "bias": np.zeros(2)}
        kind = nengo.SpikingRectifiedLinear()
        b, c = (nengo.Ensemble(2, 1, label=n, neuron_type=kind, **alike) for n in "bc")
        nengo.Connection(a.neurons, b.neurons, transform=0.5, synapse=0.005)
        nengo.Connection(b.neurons, c.neurons, transform=0.5, synapse=0.005)
        network.p = nengo.Probe(c.neurons)
    assert moved(network) == [("a", "SP002", "a", 0), ("b", "SP015", "a -> b", 2)]
    with nengo.Simulator(network, progress_bar=False) as floats:
        floats.run(1.0)
    with Simulator(network, offload=True) as sim:
        sim.run(1.0)
    assert sim.data[network.p].mean(axis=0) == pytest.approx(
        floats.data[network.p].mean(axis=0), abs=2
    )
