"""Runs of a compilation from the cache, against runs of a fresh one, bit for bit."""

from dataclasses import dataclass, replace
from typing import ClassVar

import nengo
import numpy as np
import pytest

from spikeport import Simulator, cache
from spikeport.backends.kept import KeptCompilation
from spikeport.cache import Cache
from spikeport.compile.passes.base import ImagePass
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.errors import UsageError


@pytest.fixture
def kept(tmp_path):
    return Cache(tmp_path / "cache")


def mixed(factor=0.5):
    """Return a network with every kind of object that a host may have, and its probes."""
    with nengo.Network(seed=1) as net:
        source = nengo.Node(lambda t: np.sin(8 * t))
        a, b = nengo.Ensemble(60, 1), nengo.Ensemble(50, 2)
        out = nengo.Node(lambda t, x: 2 * x, size_in=2)
        relay = nengo.Node(size_in=1)
        nengo.Connection(source, a)
        nengo.Connection(a, b, function=lambda x: [factor * x[0], x[0] ** 2])
        nengo.Connection(b, out, synapse=0.01)
        nengo.Connection(out[0], a, transform=0.2, function=lambda x: x * 0.5)
        noise = nengo.Node(nengo.processes.WhiteSignal(1, 5))
        nengo.Connection(noise, relay)
        nengo.Connection(relay, b[1], synapse=nengo.Alpha(0.01))
        nengo.Connection(nengo.Node([0.25]), a)
        nengo.Connection(source, out[1], synapse=0.02)
        net.probed = [
            nengo.Probe(b, synapse=0.02),
            nengo.Probe(out),
            nengo.Probe(a.neurons),
            nengo.Probe(b.neurons, "voltage"),
            nengo.Probe(source, sample_every=0.005),
        ]
        net.built = [a, b, net.connections[1]]
    return net


def on_host():
    """Return a network with an ensemble on the host, and its probes."""
    with nengo.Network(seed=2) as net:
        a, b = nengo.Ensemble(30, 1), nengo.Ensemble(20, 1, neuron_type=nengo.Direct())
        nengo.Connection(nengo.Node([0.3]), a)
        nengo.Connection(a, b, function=np.square)
        nengo.Connection(b, a, transform=0.1)
        net.probed, net.built = [nengo.Probe(b), nengo.Probe(a, synapse=0.01)], [a]
    return net


def learning():
    """Return a network that learns on the chip, and its probes."""
    with nengo.Network(seed=3) as net:
        source, post = nengo.Node(lambda t: np.sin(9 * t)), nengo.Node(size_in=1)
        pre = nengo.Ensemble(40, 1)
        nengo.Connection(source, pre)
        rule = nengo.PES(learning_rate=1e-3)
        learnt = nengo.Connection(pre, post, function=lambda x: 0 * x, learning_rule_type=rule)
        nengo.Connection(post, learnt.learning_rule)
        nengo.Connection(source, learnt.learning_rule, transform=-1)
        net.probed, net.built = [nengo.Probe(post, synapse=0.02)], [pre]
    return net


def ran(network, store, pipeline=None, resets=False):
    """Return the class of a run's compilation, its data, its built arrays and its report."""
    with Simulator(network, cache=store, pipeline=pipeline, seed=5) as sim:
        sim.run(0.1)
        if resets:
            sim.reset()
            sim.run(0.1)
        data = [np.array(sim.data[probe]) for probe in network.probed]
        built = [np.array(part) for obj in network.built for part in sim.data[obj][2:]]
        return type(sim.compilation), data, built, sim.report()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("make", [mixed, on_host, learning])
def test_a_kept_compilation_runs_like_a_fresh_one(kept, make, pipeline):
    kinds, data, built, reports = zip(
        *(ran(make(), kept, pipeline, resets) for resets in (False, False, True)), strict=True
    )
    assert [issubclass(kind, KeptCompilation) for kind in kinds] == [False, True, True]
    for again in 1, 2:
        for one, other in zip(data[0], data[again], strict=True):
            np.testing.assert_array_equal(one, other, strict=True)
        for one, other in zip(built[0], built[again], strict=True):
            np.testing.assert_array_equal(one, other)
        assert reports[again] == reports[0]


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_blocks_of_a_kept_compilation_have_the_errors_of_fresh_blocks(kept):
    network = on_host()
    with Simulator(network, cache=kept) as sim:
        wanted = sim.compilation.blocks
    with Simulator(network, cache=kept) as sim:
        assert isinstance(sim.compilation, KeptCompilation)
        found = sim.compilation.blocks
    assert found.errors == wanted.errors


def test_parameters_of_a_kept_compilation_are_never_those_of_a_changed_network(kept):
    network = mixed()
    ensemble = network.all_ensembles[0]
    with Simulator(network, cache=kept) as fresh, Simulator(network, cache=kept) as again:
        ensemble.seed = 7
        with pytest.raises(UsageError, match="was changed after it was compiled"):
            again.data[ensemble]
        ensemble.seed = None
        np.testing.assert_array_equal(again.data[ensemble].gain, fresh.data[ensemble].gain)


def calling(first, second, third=None):
    """Return a network with the functions of two nodes and of a connection."""
    with nengo.Network(seed=1) as net:
        x, y, ensemble = nengo.Node(first), nengo.Node(second), nengo.Ensemble(10, 1)
        nengo.Connection(x, ensemble)
        sink = nengo.Node(size_in=1)
        nengo.Connection(y, sink, synapse=None, function=third)
        net.probed, net.built = [nengo.Probe(one) for one in (x, y, sink)], []
    return net


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_the_same_network_object_is_compiled_once(kept, pipeline):
    network = learning()
    kinds = [ran(network, kept, pipeline)[0] for _ in range(2)]
    assert [issubclass(kind, KeptCompilation) for kind in kinds] == [False, True]
    assert len(kept.entries()) == 1


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_networks_that_share_functions_differently_run_their_own_functions(kept):
    def up(_):
        return 0.5

    def down(_):
        return -0.5

    for functions in [(up, up), (up, down), (down, up, up), (down, up, down), (np.sin, up, np.sin)]:
        wanted = ran(calling(*functions), cache.NOTHING)[1]
        for one, other in zip(ran(calling(*functions), kept)[1], wanted, strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_every_change_that_affects_the_compilation_misses_the_cache(kept, monkeypatch):
    def is_kept(network, **options):
        with Simulator(network, cache=kept, **options) as sim:
            return isinstance(sim.compilation, KeptCompilation)

    assert not is_kept(mixed())
    assert is_kept(mixed())
    assert not is_kept(mixed(0.25))
    assert not is_kept(mixed(), dt=0.002)
    assert not is_kept(mixed(), pipeline="compact")
    assert not is_kept(mixed(), offload=True)
    assert not is_kept(mixed(), remove_passthrough=False)
    monkeypatch.setattr(cache, "surroundings", lambda: "another NumPy")
    assert not is_kept(mixed())


def test_a_kept_compilation_repeats_the_warnings_of_the_compiler(kept):
    for _ in range(2):
        with pytest.warns(UserWarning, match="initial values for 'voltage'"):
            Simulator(on_host(), cache=kept).close()


def test_a_function_that_cannot_be_kept_is_compiled_with_a_warning(kept):
    class Mine:
        factor = 2

    mine = Mine()
    with nengo.Network(seed=0) as network:
        a, b = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
        nengo.Connection(a, b, function=lambda x: mine.factor * x)
    with pytest.warns(UserWarning, match="cache: .*Mine has no identity.* in each run"):
        Simulator(network, cache=kept).close()
    assert kept.entries() == []


def numbering(reverse):
    """Return a pipeline of a user's pass, which numbers cores as they are, or in reverse."""

    @dataclass(frozen=True)
    class Numbered(ImagePass):
        name: ClassVar[str] = "numbered"

        def apply(self, image, context):
            core = image.blocks.core
            core = core.max() - core if reverse else core
            return replace(image, blocks=replace(image.blocks, core=core))

    return Pipeline((Numbered(),))


@pytest.mark.filterwarnings("ignore:.*initial values for 'voltage'")
def test_a_pass_of_the_users_is_not_kept_since_its_code_may_change(kept):
    with nengo.Network(seed=0) as network:
        nengo.Connection(nengo.Ensemble(10, 1), nengo.Ensemble(10, 1))
    cores = []
    for reverse in False, True:
        with (
            pytest.warns(UserWarning, match="cache: pass numbered of .* no identity.* in each run"),
            Simulator(network, cache=kept, pipeline=numbering(reverse)) as sim,
        ):
            cores.append(sim.image.blocks.core)
    assert kept.entries() == []
    np.testing.assert_array_equal(cores[1], cores[0][::-1])


def test_a_sparse_matrix_on_the_host_is_not_kept(kept):
    with nengo.Network(seed=0) as network:
        a, b = nengo.Node([1, 2]), nengo.Node(lambda t, x: None, size_in=2)
        matrix = nengo.Sparse((2, 2), init=[1, 2], indices=[[0, 0], [1, 1]])
        nengo.Connection(a, b, transform=matrix)
        nengo.Connection(a[0], nengo.Ensemble(10, 1))
    with pytest.warns(UserWarning, match="cache: .* in each run"):
        Simulator(network, cache=kept).close()
    assert kept.entries() == []
