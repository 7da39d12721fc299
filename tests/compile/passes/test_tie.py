"""`Tie`: one decoder in place of many, with the cores, energy and error that it notes."""

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import nengo
import numpy as np
import pytest
from nengo_loihi.neurons import LoihiSpikingRectifiedLinear, loihi_rates

from spikeport.backends.host_loop import HostLoop
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.passes import tie
from spikeport.compile.passes.parse import parse
from spikeport.compile.passes.tie import Tie
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.compile.rewriting.decode_paths import _relay_rate
from spikeport.errors import UsageError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.energy import energy
from spikeport.networks.policy import PolicyOptions, exact
from tests.helpers.chip_files import chip_file
from tests.helpers.policies import LAYERS, OBSERVATIONS, STEPS, built
from tests.helpers.random_networks import rewritten
from tests.helpers.same_run import context
from tests.helpers.side_by_side import assert_equal_steps, random_spikes
from tests.helpers.small_networks import rewrite_of

N_UNITS = 8
N_NEURONS = 12
FOLLOWING = "fuse,decode_path,scale_rows,merge_axons,split,pack"


def layer(label: str, **options: Any) -> nengo.networks.EnsembleArray:
    """Return units of neurons that fire above zero, with rates that differ."""
    like = {
        "encoders": nengo.dists.Choice([[1.0]]),
        "intercepts": nengo.dists.Choice([0.0]),
        "max_rates": nengo.dists.Uniform(100, 200),
        "eval_points": nengo.dists.Uniform(0, 1),
        "neuron_type": LoihiSpikingRectifiedLinear(),
    }
    return nengo.networks.EnsembleArray(N_NEURONS, N_UNITS, label=label, **{**like, **options})


def layers(**options: Any) -> nengo.Network:
    """Return two layers of units, all of the first wired to all of the second."""
    with nengo.Network(seed=2, label="layers") as network:
        weights = np.random.RandomState(0).randn(2, N_UNITS, N_UNITS) / np.sqrt(N_UNITS)
        stimulus = nengo.Node(np.linspace(0.2, 0.9, N_UNITS), label="stimulus")
        first, second = layer("first", **options), layer("second", **options)
        nengo.Connection(stimulus, first.input, synapse=None)
        nengo.Connection(first.output, second.input, transform=weights[0], synapse=0.005)
        output = nengo.Node(lambda _t, x: x, size_in=N_UNITS, label="output")
        nengo.Connection(second.output, output, transform=weights[1], synapse=0.005)
        network.probe = nengo.Probe(output)
    return network


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a chip whose cores have little memory."""
    return chip_file(tmp_path_factory.mktemp("chip") / "small.toml", synapse_bits=60_000)


def compiled(passes: str, chip: str | Path, **options: Any) -> Compilation:
    return compile_network(layers(**options), chip, pipeline=passes)


@pytest.mark.slow
def test_a_network_with_a_connection_to_a_slice_can_be_tried(small: Path) -> None:
    network = layers()
    with network:
        a, b = (nengo.Ensemble(20, 1, label=label) for label in "ab")
        nengo.Connection(nengo.Node([0.5]), b)
        nengo.Connection(b.neurons, a.neurons[:10], transform=1e-3 * np.eye(10, 20))
        for pre in (a, b):
            # An ensemble that learns is not taken apart, so that the slice stays.
            learned = nengo.Connection(pre, nengo.Node(size_in=1), learning_rule_type=nengo.PES())
            nengo.Connection(nengo.Node([0.1]), learned.learning_rule)
    (tied, *_) = compile_network(network, small, pipeline=f"tie,{FOLLOWING}").report.passes
    assert tied["notes"]["cores"]["before"] is not None


@pytest.fixture(scope="module")
def untied(small: Path) -> Compilation:
    return compiled(FOLLOWING, small)


@pytest.fixture(scope="module")
def tied(small: Path) -> Compilation:
    return compiled(f"tie,{FOLLOWING}", small)


def notes_of(compilation: Compilation) -> dict[str, Any]:
    return compilation.report.passes[0]["notes"]


@pytest.mark.slow
def test_the_noted_cores_and_energy_are_those_of_compiles_without_and_with_the_pass(
    untied: Compilation, tied: Compilation
) -> None:
    notes = notes_of(tied)
    cores = {"before": len(untied.report.cores), "after": len(tied.report.cores)}
    assert notes["cores"] == cores
    assert cores["after"] < cores["before"]
    loihi = chips.get("loihi")
    for name, calibration in zip(("davies2018", "nahuku-fit"), loihi.calibrations, strict=True):
        for when, one in (("before", untied), ("after", tied)):
            spent = energy(expected_activity(one.image, Rates(100)), loihi, calibration)
            noted = notes[f"energy_step_j ({name})"][when]
            assert noted == pytest.approx(spent.dynamic.energy_step.value)


@pytest.mark.slow
def test_a_network_that_only_fits_when_it_is_tied_is_tied(tmp_path: Path) -> None:
    chip = chip_file(tmp_path / "few_axons.toml", compartments=70, in_axons=42)
    with nengo.Network(seed=0) as network:
        a, b = nengo.Ensemble(70, 1, label="a"), nengo.Ensemble(60, 1, label="b")
        nengo.Connection(nengo.Node([0.5]), a)
        nengo.Connection(a, b)
    following = "merge_axons,split,pack,place"
    with pytest.raises(DoesNotFitError, match="SP102"):
        compile_network(network, chip, pipeline=following)
    tied = compile_network(network, chip, pipeline=f"tie{{max_error=10}},{following}")
    assert notes_of(tied)["group a"]["chosen"] == "tied"
    assert notes_of(tied)["cores"] == {"before": None, "after": len(tied.report.cores)}


@pytest.mark.slow
def test_the_noted_energy_counts_at_most_one_spike_a_step(small: Path) -> None:
    compilation = compile_network(layers(), small, dt=0.02, pipeline=f"tie,{FOLLOWING}")
    noted = notes_of(compilation)["energy_step_j (davies2018)"]["after"]
    loihi = chips.get("loihi")
    spent = energy(expected_activity(compilation.image, Rates(50)), loihi, loihi.calibrations[0])
    assert noted == pytest.approx(spent.dynamic.energy_step.value)


def test_native_and_emulator_agree_on_a_tied_network(tied: Compilation) -> None:
    states = assert_equal_steps(tied.image, 1, random_spikes(tied.image, 60, 1))
    assert sum(state.spiked.sum() for state in states) > 100


@pytest.mark.parametrize(("path", "neurons"), [("onoff", 2), ("preset10", 20)])
def test_relays_are_assumed_to_fire_as_they_do_at_zero(path: str, neurons: int) -> None:
    image = compiled(f"fuse,decode_path{{default={path}}}", "loihi").image
    ((name, rate),) = tie._relay_rates_hz(image).items()
    assert " -> " in name
    assert rate * neurons == pytest.approx(_relay_rate(path, 0.001), rel=0.03)


def run(network: nengo.Network, compilation: Compilation, n_steps: int) -> np.ndarray:
    """Return the values that the network's probe records on the chip."""
    loop = HostLoop(compilation, NativeChip(compilation.image, seed=1), seed=1)
    for _ in range(n_steps):
        loop.step()
    recorded: np.ndarray = loop.data(network.probe)
    return recorded


def test_a_tied_network_computes_nearly_the_same_on_the_chip(small: Path) -> None:
    network = layers()
    before, after = (
        run(network, compile_network(network, small, pipeline=passes), 600)[200:].mean(axis=0)
        for passes in (FOLLOWING, f"tie,{FOLLOWING}")
    )
    difference = np.linalg.norm(after - before) / np.linalg.norm(before)
    assert 0.001 < difference < 0.1


def policy_with_own_decoders() -> nengo.Network:
    """Return a policy whose neurons have a decoder each, and its observations one by one."""
    with nengo.Network(seed=1) as network:
        net = built(PolicyOptions())
        for half in (half for hidden in net.layers for half in hidden.halves):
            half.decoded.solver = nengo.solvers.LstsqL2()
        held = nengo.Node(nengo.processes.PresentInput(OBSERVATIONS[:20], STEPS * 1e-3))
        nengo.Connection(held, net.observation, synapse=None)
        network.probe = nengo.Probe(net.action)
    return network


@pytest.mark.slow
def test_a_tied_policy_takes_fewer_cores_and_acts_nearly_as_well(small: Path) -> None:
    network, wanted = policy_with_own_decoders(), exact(LAYERS, OBSERVATIONS[:20])[-1]
    cores, errors = [], []
    for passes in (FOLLOWING, f"tie,{FOLLOWING}"):
        compilation = compile_network(network, small, pipeline=passes)
        actions = run(network, compilation, STEPS * len(wanted)).reshape(len(wanted), STEPS, -1)
        found = actions[:, STEPS // 2 :].mean(axis=1)
        cores.append(compilation.image.n_cores)
        errors.append(np.sqrt(np.mean((found - wanted) ** 2) / np.var(wanted)))
    assert notes_of(compilation)["cores"] == {"before": cores[0], "after": cores[1]}
    assert cores[1] < 0.7 * cores[0]
    assert errors[1] < errors[0] + 0.05


def neurons(seed: int = 0) -> nengo.Network:
    """Return one ensemble, whose neurons are read with decoders of their own."""
    with nengo.Network(seed=seed) as network:
        points = np.linspace(0, 1, 25)[:, np.newaxis]
        held = nengo.processes.PresentInput(points, 0.1)
        units = nengo.Ensemble(
            N_NEURONS,
            1,
            encoders=np.ones((N_NEURONS, 1)),
            intercepts=nengo.dists.Uniform(-0.1, 0.1),
            max_rates=nengo.dists.Uniform(100, 200),
            neuron_type=LoihiSpikingRectifiedLinear(),
            eval_points=points,
            label="units",
        )
        nengo.Connection(nengo.Node(held), units, synapse=None)
        output = nengo.Node(size_in=1)
        nengo.Connection(units, output, function=np.sqrt, synapse=None)
        network.probe = nengo.Probe(output)
    return network


def always(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a choice of more groups always count as saving cores."""
    monkeypatch.setattr(tie._Trials, "saves", lambda _self, choice, than: len(choice) > len(than))


def test_the_noted_error_is_that_of_the_shared_decoder(monkeypatch: pytest.MonkeyPatch) -> None:
    always(monkeypatch)
    network = neurons()
    rewrite, notes = rewritten(network, Tie(max_error=1))
    (connection,) = [c for c in rewrite.network.connections if c not in network.connections]
    with nengo.Simulator(network, progress_bar=False) as sim:
        units = sim.data[network.ensembles[0]]
    points = np.linspace(0, 1, 25)[:, np.newaxis]
    along = np.tile(points, N_NEURONS)
    rates = loihi_rates(LoihiSpikingRectifiedLinear(), along, units.gain, units.bias, 0.001)
    values, total = np.sqrt(points), rates.sum(axis=1, keepdims=True)
    decoder = (total * values).sum() / np.square(total).sum()
    np.testing.assert_allclose(connection.solver.values, np.full((N_NEURONS, 1), decoder))
    own, _ = nengo.solvers.LstsqL2()(rates, values)
    wrong = [rates @ own - values, decoder * total - values]
    before, after = (np.sqrt(np.square(w).sum() / np.square(values).sum()) for w in wrong)
    assert notes["error"] == {"before": pytest.approx(before), "after": pytest.approx(after)}
    assert after > 1.2 * before


def test_a_run_in_float_has_the_noted_error(monkeypatch: pytest.MonkeyPatch) -> None:
    always(monkeypatch)
    network = neurons()
    rewrite, notes = rewritten(network, Tie(max_error=1))
    values = np.sqrt(np.linspace(0, 1, 25))
    with nengo.Simulator(rewrite.network, progress_bar=False) as sim:
        sim.run(2.5, progress_bar=False)
    means = sim.data[rewrite.stand_ins.get(network.probe, network.probe)].reshape(25, 100).mean(1)
    error = np.linalg.norm(means - values) / np.linalg.norm(values)
    assert error == pytest.approx(notes["error"]["after"], rel=0.1)


def test_a_connection_whose_error_would_rise_too_much_is_not_tied(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    always(monkeypatch)
    network = neurons()
    rewrite, notes = rewritten(network, Tie(max_error=0.01))
    assert rewrite.network is network
    assert notes["group units"]["chosen"] == "own decoders"
    assert notes["group units"]["reason"] == "error rises by more than 0.01"
    assert notes["group units"]["connections"] == {"tied": 0, "of": 1}
    assert notes["error"]["before"] == notes["error"]["after"] > 0
    assert "cores" not in notes


def test_groups_that_save_no_core_are_not_tied() -> None:
    compilation = compiled(f"tie,{FOLLOWING}", "loihi")
    notes = notes_of(compilation)
    assert notes["cores"] == {"before": 1, "after": 1}
    groups = [note for note in notes.values() if "chosen" in note]
    assert [(one["chosen"], one["reason"]) for one in groups] == [
        ("own decoders", "saves no core")
    ] * 2
    assert compilation.image.digest == compiled(FOLLOWING, "loihi").image.digest


def test_a_group_that_saves_no_core_gets_its_own_decoders_back(small: Path) -> None:
    spread = nengo.dists.Uniform(-0.2, 0.2)
    passes = f"tie{{negligible=0}},{FOLLOWING}"
    notes = notes_of(compiled(passes, small, intercepts=spread))
    first, second = (note for note in notes.values() if "chosen" in note)
    assert (first["chosen"], second["chosen"]) == ("tied", "own decoders")
    assert second["reason"] == "saves no core"


def test_a_network_that_is_refused_without_tying_can_be_tied(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    image = tie._image

    def first_refused(rewrite: Any, given: Any) -> Any:
        if not rewrite.stand_ins and not rewrite.built:
            raise RefusedError("no")
        return image(rewrite, given)

    monkeypatch.setattr(tie, "_image", first_refused)
    notes: dict[str, Any] = {}
    given = replace(context(note=notes), following=parse(FOLLOWING).passes)
    Tie().apply(rewrite_of(layers()), given)
    assert notes["cores"] == {"before": None, "after": 1}
    assert notes["energy_step_j (davies2018)"]["before"] is None


def others() -> nengo.Network:
    """Return ensembles whose decoders cannot be shared."""
    with nengo.Network(seed=1) as network:
        plane = nengo.Ensemble(10, 2)
        one = nengo.Ensemble(1, 1)
        given = nengo.Ensemble(10, 1)
        pupil = nengo.Ensemble(10, 1)
        error = nengo.Node(size_in=1)
        nengo.Connection(plane, one, function=lambda x: x[0])
        nengo.Connection(one, given)
        nengo.Connection(given, one, solver=nengo.solvers.NoSolver(np.arange(10.0)[:, np.newaxis]))
        nengo.Connection(given, one, solver=nengo.solvers.LstsqL2(weights=True))
        taught = nengo.Connection(pupil, error, learning_rule_type=nengo.PES())
        nengo.Connection(error, taught.learning_rule)
    return network


def test_a_network_without_decoders_to_share_is_not_compiled_for_a_trial(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tie, "_image", None)
    network = others()
    rewrite, notes = rewritten(network, Tie())
    assert rewrite.network is network
    assert notes == {}


def test_tie_cannot_follow_fuse() -> None:
    with pytest.raises(UsageError) as caught:
        parse("fuse,tie")
    assert str(caught.value) == "pass tie cannot follow fuse; put it before fuse"


def test_a_negative_max_error_is_refused() -> None:
    with pytest.raises(UsageError) as caught:
        parse("tie{max_error=-1}")
    assert str(caught.value) == (
        "pass tie: max_error=-1: input should be greater than or equal to 0"
    )


def test_warnings_of_trial_compiles_are_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = tie._image

    def warning(*args: Any) -> Any:
        warnings.warn("of a trial", UserWarning, stacklevel=1)
        return compiled(*args)

    monkeypatch.setattr(tie, "_image", warning)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = compile_network(layers(), pipeline=f"tie,{FOLLOWING}").report.warnings
    assert not [text for text in found if "of a trial" in text]
    assert [str(one.message) for one in caught] == [*found]
