"""`DecodePath`: the paths of decoded values between ensembles, and the choice of one."""

import re
from pathlib import Path
from typing import Any

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.backends.host_loop import HostLoop
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.image.usage import core_uses
from spikeport.compile.loihi.build import build
from spikeport.compile.passes.decode_path import DecodePath
from spikeport.compile.passes.fuse import Fuse
from spikeport.compile.passes.parse import parse
from spikeport.compile.pipeline import compile_network
from spikeport.compile.rewriting.decode_paths import CROWDED, OTHER_FILTER
from tests.helpers.chip_files import chip_file
from tests.helpers.event_files import camera_network, process_of, random_events, write_events
from tests.helpers.random_networks import assert_equal_in_float, random_network, rewritten


@pytest.mark.slow
@pytest.mark.parametrize("path", ["direct", "host", "onoff", "preset10", "auto"])
@pytest.mark.parametrize("seed", range(2))
def test_every_path_computes_the_same_in_float(seed: int, path: str) -> None:
    network = random_network(seed)
    assert_equal_in_float(network, Fuse(), DecodePath(default=path))
    assert_equal_in_float(network, DecodePath(default=path))


def chain(path: str = "auto", tau: Any = 0.005, n: int = 60) -> nengo.Network:
    with nengo.Network(seed=4, label="chain") as network:
        spikeport.add_params(network)
        stimulus = nengo.Node(lambda t: np.sin(12 * t), label="stimulus")
        first = nengo.Ensemble(n, 1, label="first")
        second = nengo.Ensemble(n, 1, label="second")
        nengo.Connection(stimulus, first)
        connection = nengo.Connection(first, second, synapse=tau)
        network.config[connection].decode_path = path
        output = nengo.Node(lambda _t, x: x, size_in=1, label="output")
        nengo.Connection(second, output, synapse=0.02)
        network.probe = nengo.Probe(output)
    return network


def note(network: nengo.Network, **options: object) -> dict[str, Any]:
    _, notes = rewritten(network, DecodePath(**options))
    return notes["first -> second"]


def chosen(network: nengo.Network, **options: object) -> str:
    return note(network, **options)["chosen"]


def reasons(network: nengo.Network, **options: object) -> dict[str, str | None]:
    return {one["path"]: one["not_chosen"] for one in note(network, **options)["paths"]}


def test_the_setting_of_a_connection_overrides_the_default() -> None:
    assert chosen(chain("host"), default="onoff") == "host"
    assert chosen(chain(), default="onoff") == "onoff"


def test_auto_takes_the_path_with_the_least_error_within_the_allowed_cores() -> None:
    assert chosen(chain()) == "direct"
    assert chosen(chain(n=400)) == "direct"
    assert chosen(chain(n=400), slack_cores=0.5) == "preset10"


def test_no_example_of_the_docs_takes_a_coarse_path() -> None:
    root = Path(__file__).parents[3]
    pages = [root / "README.md", *sorted((root / "docs").rglob("*.md"))]
    pattern = r'^    spikeport compile [^#\n]*-p "?([^\s"]+)'
    examples = {e for page in pages for e in re.findall(pattern, page.read_text(), re.M)}
    assert "compact" in examples
    paths = [one for e in examples for one in parse(e).networks if one.name == "decode_path"]
    assert {one.slack_cores for one in paths} == {DecodePath().slack_cores}


def beside(synapse: float, *fixed: float) -> nengo.Network:
    """Return the chain with connections between its neurons, each with a filter of its own."""
    network = chain(tau=synapse)
    first, second = network.ensembles
    with network:
        for tau in fixed:
            nengo.Connection(
                first.neurons, second.neurons, transform=1e-3 * np.eye(60), synapse=tau
            )
    return network


@pytest.mark.parametrize(
    ("synapse", "fixed", "path"),
    [
        (0.005, (0.05,), "preset10"),
        (0.05, (0.005,), "preset10"),
        (0.05, (0.05,), "direct"),
        (0.05, (), "direct"),
        (0.002, (0.05,), "preset10"),
        (0.011, (0.005,), "direct"),
        (0.012, (0.005,), "preset10"),
    ],
)
def test_no_input_shares_a_filter_that_is_slower_than_a_relay_of_its_own(
    synapse: float, fixed: tuple[float, ...], path: str
) -> None:
    assert chosen(beside(synapse, *fixed)) == path


def test_a_slow_connection_beside_a_fast_input_from_the_host_is_not_direct() -> None:
    network = chain(tau=0.1)
    with network:
        nengo.Connection(network.nodes[0], network.ensembles[1])
    assert chosen(network) == "preset10"
    assert reasons(network)["direct"] == OTHER_FILTER


def both(first: float, second: float, path: str = "auto") -> Rewrite:
    """Return the rewritten chain with a second connection, through another filter."""
    network = chain(path, tau=first)
    with network:
        nengo.Connection(*network.ensembles, function=np.square, synapse=second)
    return rewritten(network, DecodePath())[0]


def paths(rewrite: Rewrite) -> list[str]:
    config = rewrite.network.config
    return sorted(config[one].decode_path for one in rewrite.network.connections)


def test_the_fastest_connection_is_direct_and_a_relay_filters_the_slower_one() -> None:
    rewrite = both(0.1, 0.01)
    assert paths(rewrite) == ["auto", "auto", "direct", "preset10"]
    filters = [(b.n_neurons, b.compartment.tau_s) for b in build(rewrite, 0.001).blocks]
    assert (20, pytest.approx(0.1 - 0.01 - 0.001)) in filters
    assert (60, 0.01) in filters


def test_a_relay_gives_its_target_a_filter_for_its_noise() -> None:
    """Unfiltered spikes of a relay turned the choice of a basal ganglia around."""
    rewrite = both(0.1, 0.0)
    assert paths(rewrite) == ["auto", "auto", "direct", "preset10"]
    blocks = [block for block in build(rewrite, 0.001).blocks if block.n_neurons == 60]
    assert [block.compartment.tau_s for block in blocks] == [0.005, 0.005]


def test_a_relay_does_not_keep_slow_inputs_from_direct_wiring() -> None:
    network = chain(tau=0.1)
    with network:
        relayed = nengo.Connection(*network.ensembles, function=np.square, synapse=0.1)
    spikeport.add_params(network)
    network.config[relayed].decode_path = "onoff"
    assert paths(rewritten(network, DecodePath())[0]) == ["auto", "auto", "direct", "onoff"]


def test_filters_that_differ_by_less_than_the_delay_of_a_relay_are_shared() -> None:
    assert paths(both(0.008, 0.002)) == ["auto", "auto", "direct", "direct"]


def test_a_connection_set_to_direct_determines_the_filter_of_its_target() -> None:
    assert paths(both(0.05, 0.05, "direct")) == ["auto", "auto", "direct", "direct"]


def test_auto_takes_the_host_if_its_delay_is_allowed() -> None:
    options = {"slack_cores": 0.5, "slack_delay_s": 0.001}
    assert chosen(chain(n=400), **options) == "host"
    assert chosen(chain(n=400), slack_cores=0.5) == "preset10"


def test_every_path_that_is_not_chosen_has_a_reason() -> None:
    assert reasons(chain(n=400), slack_cores=0.5) == {
        "direct": "1.3 more cores than the fewest",
        "onoff": "has a larger error than preset10",
        "preset10": None,
        "host": "1 ms slower than decode neurons",
    }
    assert reasons(chain("host")) == {
        "direct": "host is set",
        "onoff": "host is set",
        "preset10": "host is set",
        "host": None,
    }


def test_the_path_over_the_host_costs_two_messages_in_every_step() -> None:
    (host,) = [one for one in note(chain())["paths"] if one["path"] == "host"]
    assert host["host_messages_per_s"] == 2 * 1000


def lag_s(path: str) -> float:
    """Return the delay of the output behind the sine, in seconds."""
    t = np.arange(1, 2001) * 0.001
    wave = np.exp(-12j * t)
    found, wanted = run(chain(path, n=200), len(t))[:, 0] @ wave, np.sin(12 * t) @ wave
    return float(-np.angle(found / wanted) / 12)


@pytest.mark.slow
@pytest.mark.parametrize("path", ["onoff", "preset10", "host"])
def test_the_noted_delay_is_that_of_a_run(path: str) -> None:
    (cost,) = [one for one in note(chain())["paths"] if one["path"] == path]
    assert lag_s(path) - lag_s("direct") == pytest.approx(cost["delay_s"], abs=0.003)


@pytest.mark.parametrize(
    ("path", "compartments"), [("direct", 0), ("onoff", 2), ("preset10", 20), ("host", 2)]
)
def test_each_path_takes_its_number_of_compartments_on_the_chip(
    path: str, compartments: int
) -> None:
    compilation = compile_network(chain(path), pipeline="decode_path")
    cores = core_uses(compilation.image, compilation.report.chip)
    assert sum(core.compartments for core in cores) == 120 + 2 + compartments


def test_any_filter_is_allowed_on_the_path_over_the_host() -> None:
    alpha = nengo.Alpha(0.01)
    assert run(chain("host", tau=alpha), n_steps=10).shape == (10, 1)
    with pytest.raises(DoesNotFitError, match="first -> second: SP005 synapse: Alpha"):
        run(chain("direct", tau=alpha))


def test_an_ensemble_can_have_two_kinds_of_relay() -> None:
    network = chain("onoff")
    with network:
        other = nengo.Connection(*network.ensembles, function=lambda x: -x)
    network.config[other].decode_path = "preset10"
    compilation = compile_network(network, pipeline="decode_path")
    blocks = compilation.image.manifest.blocks
    sizes = np.diff(compilation.image.blocks.start)
    relays = [int(n) for b, n in zip(blocks, sizes, strict=True) if b.kind == "relay"]
    assert sorted(relays) == [2, 20]


def run(network: nengo.Network, n_steps: int = 600) -> np.ndarray:
    compilation = compile_network(network, pipeline="decode_path")
    loop = HostLoop(compilation, NativeChip(compilation.image, seed=1), seed=1)
    for _ in range(n_steps):
        loop.step()
    return loop.data(network.probe)


def test_direct_wiring_follows_values_better_than_decode_neurons() -> None:
    wanted = np.sin(12 * np.arange(1, 601) * 0.001)[:, np.newaxis]
    error = {path: np.std(run(chain(path)) - wanted) for path in ("direct", "onoff")}
    assert error["direct"] < error["onoff"]


def integrator(seed: int) -> nengo.Network:
    """Return the integrator of the NEF: its input has the synapse and a transform of 0.1 s."""
    with nengo.Network(seed=seed) as network:
        stimulus = nengo.Node([0.6])
        first, memory = nengo.Ensemble(100, 1), nengo.Ensemble(100, 1)
        nengo.Connection(stimulus, first)
        nengo.Connection(memory, memory, synapse=0.1)
        nengo.Connection(first, memory, transform=0.1, synapse=0.1)
        nengo.Probe(memory, synapse=0.02)
    return network


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_integrator_integrates_as_it_does_as_written(seed: int) -> None:
    ends = {}
    for pipeline in ("as_written", "compact"):
        network = integrator(seed)
        with spikeport.Simulator(network, pipeline=pipeline, progress_bar=False) as simulator:
            simulator.run(1.0)
            ends[pipeline] = float(simulator.data[network.probes[0]][-100:].mean())
    assert ends["compact"] == pytest.approx(ends["as_written"], abs=0.12)
    assert ends["compact"] > 0.4


@pytest.mark.slow
def test_a_target_gets_no_more_direct_inputs_than_a_core_has_axons(tmp_path: Path) -> None:
    """Two of these connections are relayed so that the other two fit."""
    with nengo.Network(seed=4) as network:
        target = nengo.Ensemble(20, 3, label="target", radius=1.5)
        for number in range(4):
            kind = nengo.LIF(tau_rc=0.02 + 0.001 * number)  # of another type each: none are fused
            source = nengo.Ensemble(100, 3, label=f"source {number}", neuron_type=kind)
            nengo.Connection(nengo.Node([0.5]), source[0])
            nengo.Connection(source, target, transform=0.25, synapse=0.005)
    chip = chip_file(tmp_path / "few.toml", in_axons=350)
    many, few = (compile_network(network, one, pipeline="compact") for one in ("loihi", chip))
    notes = [
        next(one["notes"] for one in compiled.report.passes if one["name"] == "decode_path")
        for compiled in (many, few)
    ]
    paths, fewer = ([note["chosen"] for note in found.values()] for found in notes)
    assert paths == ["direct"] * 4
    assert sorted(fewer) == ["direct", "direct", "preset10", "preset10"]
    reasons = {path["not_chosen"] for note in notes[1].values() for path in note["paths"]}
    assert CROWDED in reasons


def test_events_of_a_file_are_not_decoded_on_the_host_by_default(tmp_path: Path) -> None:
    path = write_events(tmp_path / "camera.events", **random_events(200, last_us=50_000))
    network = camera_network(process_of(path))
    compiled = compile_network(network, pipeline="decode_path{default=host}")
    (passed, *_) = compiled.report.passes
    assert {note["chosen"] for note in passed["notes"].values()} <= {"direct", "onoff", "preset10"}
