"""Every row of docs/migrating.md: nengo-loihi's simulator beside ours, or the refusal in words."""

import threading
import warnings
from pathlib import Path

import nengo
import nengo_loihi
import numpy as np
import pytest
from nengo_loihi.builder import Model
from nengo_loihi.decode_neurons import OnOffDecodeNeurons, Preset5DecodeNeurons

import spikeport
from spikeport import Simulator, compile_network
from spikeport.compile.loihi.build_settings import BuildSettings
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.errors import UsageError

TABLE = Path(__file__).parents[2] / "docs" / "migrating.md"
STEPS = 60
pytestmark = pytest.mark.filterwarnings("ignore")


def network(loop=False):
    """Return 2 ensembles and probes of each kind; ``loop`` adds a loop over a passthrough node.

    nengo-loihi draws random seeds for the connections that replace passthrough nodes: bits are
    equal only without such nodes.
    """
    with nengo.Network(seed=1) as net:
        stimulus = nengo.Node(lambda t: np.sin(40 * t))
        a, b = (nengo.Ensemble(20, 1, label=label) for label in "ab")
        nengo.Connection(stimulus, a)
        nengo.Connection(a, b, synapse=0.01)
        for synapse in (None, 0.01):
            nengo.Probe(b, synapse=synapse)
            nengo.Probe(a.neurons, synapse=synapse)
        nengo.Probe(a.neurons, "voltage")
        nengo.Probe(stimulus)
        if loop:
            through = nengo.Node(size_in=1)
            nengo.Connection(b, through)
            nengo.Connection(through, a, transform=-0.5)
    return net


def learning():
    """Return a connection that learns to undo its error."""
    with nengo.Network(seed=2) as net:
        stimulus = nengo.Node(0.7)
        pre = nengo.Ensemble(20, 1)
        post, error = nengo.Node(size_in=1), nengo.Node(size_in=1)
        nengo.Connection(stimulus, pre)
        learned = nengo.Connection(pre, post, function=lambda _: 0, learning_rule_type=nengo.PES())
        nengo.Connection(post, error)
        nengo.Connection(stimulus, error, transform=-1)
        nengo.Connection(error, learned.learning_rule)
        nengo.Probe(post, synapse=0.01)
    return net


def theirs(net, *arguments, **named):
    with warnings.catch_warnings(), numpy1_semantics():
        warnings.simplefilter("ignore")
        with nengo_loihi.Simulator(net, *arguments, **named) as sim:
            sim.run_steps(STEPS)
        return [sim.data[probe] for probe in net.all_probes]


def ours(net, **named):
    with Simulator(net, **named) as sim:
        sim.run_steps(STEPS)
    return [sim.data[probe] for probe in net.all_probes]


def assert_same(a, b):
    for one, other in zip(a, b, strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype


def refusal(net=None, *arguments, **named):
    with pytest.raises(UsageError) as caught:
        Simulator(net or network(), *arguments, **named)
    return str(caught.value)


def model(dt=0.001, **settings):
    made = Model(dt=dt)
    for name, value in settings.items():
        setattr(made, name, value)
    return made


def the_plain_call():
    net = network()
    assert_same(theirs(net), ours(net))


def dt_and_seed_go_by_name():
    net = network()
    assert_same(theirs(net, 0.002, 5), ours(net, dt=0.002, seed=5))
    assert refusal(net, 0.002) == (
        "chip=0.002: expected the name of a chip, or the path of its TOML file; give a time step "
        "by keyword, dt=..."
    )


def the_emulator_is_what_runs():
    net = network()
    assert_same(ours(net, target="sim"), ours(net, backend="nengo-loihi"))
    assert refusal(target="sim", backend="reference") == (
        "target='sim' needs an emulated chip, which backend='reference' lacks; leave "
        "one of them out"
    )
    assert refusal(target="chip") == "target='chip': expected None or 'sim'; see backend"


def the_float_emulation_is_refused():
    assert "choose 'reference' for float Nengo" in refusal(target="simreal")
    assert ours(network(), backend="reference")[0].shape == (STEPS, 1)


def boards_are_refused():
    assert refusal(target="loihi").startswith("target='loihi': a board is a backend here; ")
    assert_same(ours(network(), backend="board"), ours(network()))


def precompute_changes_nothing():
    net = network()
    assert_same(theirs(net, precompute=True), ours(net, precompute=True))
    assert_same(ours(net, precompute=False), ours(net))
    assert refusal(precompute="yes").startswith("precompute='yes': expected None, or a bool")


def passthrough_nodes_stay():
    net = network(loop=True)
    assert_same(theirs(net, remove_passthrough=False), ours(net, remove_passthrough=False))
    assert refusal(net, remove_passthrough=False, pipeline="compact") == (
        "remove_passthrough=False: expected True, which the passes that rewrite networks "
        "assume; or choose a pipeline without these passes: as_written"
    )
    assert refusal(remove_passthrough=1) == "remove_passthrough=1: expected a bool"


def a_model_brings_its_settings():
    settings = {"pes_error_scale": 10.0, "pes_wgt_exp": 5}
    net = learning()
    assert_same(theirs(net, model=model(**settings)), ours(net, model=model(**settings)))
    settings = {"decode_tau": 0.01, "decode_neurons": Preset5DecodeNeurons()}
    settings |= {"intercept_limit": 0.5, "vth_nonspiking": 20}
    net = network()
    changed = ours(net, model=model(**settings))
    assert_same(theirs(net, model=model(**settings)), changed)
    assert not np.array_equal(changed[0], ours(net)[0])


def a_model_that_does_not_serve_is_refused():
    assert refusal(model=5) == "model=5: expected None, or a nengo_loihi.builder.Model"
    assert refusal(model=model(dt=0.002)) == (
        "model: its dt is 0.002 s, the simulator's 0.001 s; make them equal"
    )
    built = compile_network(network()).model
    assert refusal(model=built).startswith(f"model: {len(built.blocks)} blocks are built in it")


def a_model_and_its_refusals():
    a_model_brings_its_settings()
    a_model_that_does_not_serve_is_refused()


def settings_of_a_compile():
    net = learning()
    compiled = compile_network(net, settings=BuildSettings(pes_error_scale=10.0))
    assert compiled.image.manifest.pes_error_scale == 10.0
    with Simulator(net, model=model(pes_error_scale=10.0)) as sim:
        assert sim.image.digest == compiled.image.digest


def inputs_are_pairs():
    other = model(node_neurons=OnOffDecodeNeurons(pairs_per_dim=2))
    assert refusal(model=other) == (
        "node_neurons='OnOffDecodeNeurons(pairs_per_dim=2, dt=0.001, rate=500)': expected "
        "OnOffDecodeNeurons with one pair a dimension, which is what an image can describe"
    )


def options_of_boards_are_refused():
    assert refusal(hardware_options={"snip_io_steps": 1}) == (
        "hardware_options: snip_io_steps: options of NxSDK belong to the process that serves the "
        "board, `spikeport board serve --machine nxsdk`; leave them out"
    )
    assert len(ours(network(), hardware_options={})) == len(network().all_probes)


def a_bar_is_shown(capsys):
    with Simulator(network(), progress_bar=True) as sim:
        sim.run_steps(5)
    assert "Simulation" in capsys.readouterr().out


def defaults_are_the_same(nengo_defaults):
    spikeport.set_defaults()
    made = nengo.Ensemble(5, 1, add_to_container=False)
    assert (made.max_rates.low, made.max_rates.high) == (100, 120)
    assert (made.intercepts.low, made.intercepts.high) == (-1, 0.5)


def options_are_the_same():
    net = nengo.Network()
    spikeport.add_params(net)
    assert {"on_chip", "block_shape"} <= set(net.config[nengo.Ensemble]._extra_params)
    assert {"pop_type", "decode_path"} <= set(net.config[nengo.Connection]._extra_params)
    before = nengo.Network()
    nengo_loihi.add_params(before)
    assert "decode_path" not in before.config[nengo.Connection]._extra_params
    spikeport.add_params(before)
    assert "decode_path" in before.config[nengo.Connection]._extra_params


def shapes_are_nengo_loihis():
    net = network()
    spikeport.add_params(net)
    net.config[net.ensembles[0]].block_shape = nengo_loihi.BlockShape((10,), (20,))
    assert (
        compile_network(net, pipeline="").image.n_cores
        == 1 + compile_network(network(), pipeline="").image.n_cores
    )


def a_seed_that_is_not_there_is_0():
    unseeded, other, seeded = network(), network(), network()
    unseeded.seed, other.seed, seeded.seed = None, None, 0
    assert_same(ours(unseeded), ours(other))
    assert_same(ours(unseeded), ours(seeded))
    assert not np.array_equal(ours(network())[0], ours(seeded)[0])


def processes_take_nengos_seeds():
    def signals(seed=None):
        with nengo.Network(seed=1) as net:
            probe = nengo.Probe(nengo.Node(nengo.processes.WhiteSignal(1, high=5, seed=seed)))
            nengo.Ensemble(20, 1)
        with nengo.Simulator(net, progress_bar=False) as sim:
            sim.run_steps(STEPS)
        return [sim.data[probe], ours(net)[0], theirs(net)[0], theirs(net)[0]]

    nengos, mine, first, again = signals()
    assert np.array_equal(nengos, mine)
    assert not np.array_equal(mine, first)
    assert not np.array_equal(first, again)
    assert len({one.tobytes() for one in signals(seed=2)}) == 1


def numbers_have_the_same_type():
    net = network()
    assert_same(theirs(net), ours(net))
    assert {data.dtype for data in ours(net)[:4]} == {np.dtype(float)}
    with net:
        filtered = nengo.Probe(net.all_ensembles[0].neurons, "voltage", synapse=0.01)
    with Simulator(net) as sim:
        sim.run_steps(STEPS)
    assert np.any(sim.data[filtered] % 1)


def weights_have_nengos_units():
    net = network()
    connection = net.connections[1]
    with Simulator(net) as sim, numpy1_semantics(), nengo_loihi.Simulator(net) as other:
        mine, large = sim.data[connection].weights, other.data[connection].weights
    np.testing.assert_allclose(mine / sim.dt, large)


def recordings_are_read_only():
    with Simulator(network()) as sim:
        sim.run_steps(5)
        recorded = sim.data[sim.network.probes[0]]
        with pytest.raises(ValueError, match=r"^assignment destination is read-only$"):
            recorded[:] = 0
        changed = recorded.copy()
        changed[:] = 0


def times_go_by_nengos_name():
    with Simulator(network()) as sim:
        sim.run_steps(20)
        assert np.array_equal(sim.trange(0.01), [0.01, 0.02])
        with pytest.raises(UsageError) as caught:
            sim.trange(dt=0.01)
        assert str(caught.value) == (
            "dt=0.01: expected None: the name is sample_every, as in Nengo since 3.0; cure: "
            "trange(sample_every=0.01)"
        )
        assert np.array_equal(sim.trange(sample_every=0.01), [0.01, 0.02])


def some_attributes_are_not_there():
    net = network()
    with Simulator(net) as sim:
        assert not any(hasattr(sim, name) for name in ("target", "precompute", "timers", "sims"))
        assert sim.network is net


def the_model_is_that_of_the_compilation():
    with Simulator(network()) as sim:
        assert isinstance(sim.compilation.model, Model)


def the_report_is_printed():
    with Simulator(network()) as sim:
        text = str(sim.compilation.report)
    assert "compartments" in text
    assert len(text.splitlines()) < 25


def a_simulator_starts_over():
    net = network()
    with Simulator(net) as sim:
        sim.run_steps(STEPS)
        first = sim.data[net.all_probes[0]].copy()
        sim.reset()
        sim.run_steps(STEPS)
    np.testing.assert_array_equal(sim.data[net.all_probes[0]], first)


def counts_come_besides():
    with Simulator(network()) as sim:
        sim.run_steps(5)
        assert sim.activity.n_steps == 5
        assert sim.report()["energy"]


class Slider(nengo.Process):
    """A node's output, as nengo-gui replaces it: a slider's value once it was moved."""

    def __init__(self, usual):
        super().__init__(default_size_in=0, default_size_out=1)
        self.usual, self.value = usual, None

    def make_step(self, _shape_in, _shape_out, _dt, _rng, _state=None):
        return lambda t: self.usual(t) if self.value is None else self.value


def the_gui_plots_values_and_overrides_nodes():
    """Do what nengo-gui 0.6.0 does: it adds objects for the build alone, and steps in a thread."""
    net, shown = network(), []
    (stimulus,), slider = net.nodes, Slider(net.nodes[0].output)
    with net:
        plot = nengo.Node(lambda _t, x: shown.append(x.copy()), size_in=1)
        link = nengo.Connection(net.ensembles[1], plot, synapse=0.01)
    usual, stimulus.output = stimulus.output, slider
    sim = Simulator(net, progress_bar=nengo.utils.progress.NoProgressBar())
    shown.clear()  # Nengo calls a function once to see how many values it returns
    stimulus.output = usual
    net.nodes.remove(plot)
    net.connections.remove(link)

    def steps():
        for _ in range(STEPS):
            sim.step()

    for value in (None, -0.7, 0.7):
        slider.value = value
        thread = threading.Thread(target=steps)
        thread.start()
        thread.join()
    sim.close()
    assert len(shown) == 3 * STEPS
    assert np.mean(shown[2 * STEPS - 20 : 2 * STEPS]) < -0.2
    assert np.mean(shown[3 * STEPS - 20 :]) > 0.2


ROWS = {
    "Simulator(net)": the_plain_call,
    "Simulator(net, 0.002, 5)": dt_and_seed_go_by_name,
    'Simulator(net, target="sim")': the_emulator_is_what_runs,
    'Simulator(net, target="simreal")': the_float_emulation_is_refused,
    'Simulator(net, target="loihi")': boards_are_refused,
    "Simulator(net, precompute=True)": precompute_changes_nothing,
    "Simulator(net, remove_passthrough=False)": passthrough_nodes_stay,
    "Simulator(net, model=model)": a_model_and_its_refusals,
    "model.pes_error_scale = 10.0": settings_of_a_compile,
    "model.node_neurons = ...": inputs_are_pairs,
    "Simulator(net, hardware_options={...})": options_of_boards_are_refused,
    "Simulator(net, progress_bar=True)": a_bar_is_shown,
    "nengo_loihi.set_defaults()": defaults_are_the_same,
    "nengo_loihi.add_params(net)": options_are_the_same,
    "nengo_loihi.BlockShape(...)": shapes_are_nengo_loihis,
    "nengo.Network()": a_seed_that_is_not_there_is_0,
    "WhiteSignal(1, high=5)": processes_take_nengos_seeds,
    "sim.data[probe]": numbers_have_the_same_type,
    "sim.data[connection].weights": weights_have_nengos_units,
    "sim.data[probe][:] = 0": recordings_are_read_only,
    "sim.trange(dt=0.01)": times_go_by_nengos_name,
    "sim.target": some_attributes_are_not_there,
    "sim.model": the_model_is_that_of_the_compilation,
    "sim.model.utilization_summary()": the_report_is_printed,
    "sim.reset()": a_simulator_starts_over,
    "sim.run(1.0)": counts_come_besides,
    "nengo -b nengo_loihi script.py": the_gui_plots_values_and_overrides_nodes,
}


def test_every_row_of_the_table_has_a_check():
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    assert [line.split("`")[1] for line in lines if line.startswith("| `")] == list(ROWS)


@pytest.mark.parametrize("row", ROWS)
def test_a_row_of_the_table_holds(row, request):
    check = ROWS[row]
    names = check.__code__.co_varnames[: check.__code__.co_argcount]
    check(*(request.getfixturevalue(name) for name in names))
