"""Cures for hints, SP4xx."""

from collections.abc import Callable
from functools import partial

import nengo
import nengo_loihi
import numpy as np

import spikeport
from spikeport.backends.loss import measure, network_error
from spikeport.commands.against_written import as_written, more_cores, more_loss
from spikeport.compile.pipeline import compile_network
from spikeport.progress import silent
from tests.helpers.cured import Case, Check, hinted, network_of
from tests.helpers.network_cures import from_host


def dead_end(probe: bool = False, function: bool = False) -> None:
    a = nengo.Ensemble(20, 1)
    end = nengo.Node((lambda t, x: x) if function else None, size_in=1)
    nengo.Connection(a, end)
    if probe:
        nengo.Probe(end)


def decoded(factor: float, connected: bool = True) -> None:
    a = nengo.Ensemble(20, 1)
    if connected:
        nengo.Connection(a, nengo.Node(lambda t, x: x, size_in=1), function=lambda x: factor * x)


def silenced_by(n: int, weight: float) -> None:
    """Add n neurons that inhibit others."""
    a, b = nengo.Ensemble(n, 1), nengo.Ensemble(20, 1)
    nengo.Connection(a.neurons, b.neurons, transform=np.full((20, n), weight / n))


def steep(intercept: float) -> None:
    """Add a steep neuron among flat ones, in so many dimensions that most weights are small."""
    a = nengo.Ensemble(40, 6, intercepts=[intercept, *[-0.9] * 39])
    nengo.Connection(nengo.Node(np.zeros(6)), a)


def strong(sources: int) -> None:
    """Add fifty weak sources, and a strong input from one source or several."""
    weak = np.random.RandomState(0).uniform(0.0002, 0.004, (30, 50))
    weights = np.hstack([weak, np.full((30, sources), 1 / sources)])
    wired(weights)


def rectified(kind: nengo.neurons.NeuronType) -> None:
    a, b = (nengo.Ensemble(2, 1, neuron_type=kind) for _ in range(2))
    nengo.Connection(a.neurons, b.neurons, transform=[[0.01, -0.01], [0.0, 0.01]])


def strong_neuron() -> None:
    weights = np.random.RandomState(0).uniform(0.002, 0.004, (30, 50))
    weights[0] *= 1000
    wired(weights)


def wired(weights: np.ndarray) -> None:
    n, sources = weights.shape
    a = nengo.Ensemble(n, 1, gain=np.ones(n), bias=np.ones(n))
    nengo.Connection(nengo.Ensemble(sources, 1).neurons, a.neurons, transform=weights)


def alike(n: int, random: bool = False) -> None:
    if random:
        nengo.Ensemble(n, 1)
    else:
        nengo.Ensemble(n, 1, gain=np.ones(n), bias=np.full(n, 2.0), encoders=np.ones((n, 1)))


def idle(n: int = 10, gain: float = 0.3, bias: float = 0.5) -> None:
    """Add 10 neurons, the last 5 of which have too little drive; keep the first ``n`` of them."""
    biases = np.where(np.arange(10) < 5, np.linspace(2, 3, 10), bias)[:n]
    a = nengo.Ensemble(n, 1, gain=np.full(n, gain), bias=biases, encoders=np.ones((n, 1)))
    nengo.Connection(nengo.Node(0.5), a)


def looped(synapse: nengo.synapses.Synapse | None) -> None:
    a = nengo.Ensemble(20, 1)
    nengo.Connection(a.neurons, a.neurons, transform=-0.001 * np.eye(20), synapse=synapse)


def measured(make: Callable[[], object], dt_s: float = 0.001, passes: str = "as_written") -> Check:
    """Return a check of the hints of a run."""

    def check() -> set[str]:
        network = network_of(make)
        compilation = compile_network(network, dt=dt_s, pipeline=passes)
        return {one.id for one in measure(network, compilation, 0.3, 0, silent).loss.hints}

    return check


def read_out(scale: float) -> None:
    a = nengo.Ensemble(30, 1)
    nengo.Connection(nengo.Node(0.9), a)
    nengo.Connection(a, nengo.Node(lambda t, x: x, size_in=1), function=lambda x: scale * x)


def slow(n: int = 2, rate_hz: float = 60.0, factor: float = 1.0) -> None:
    """Add neurons that are read out, with a maximum rate, and a factor on what is decoded."""
    kind = nengo.dists.Choice([rate_hz])
    a = nengo.Ensemble(n, 1, max_rates=kind, intercepts=nengo.dists.Choice([-0.5]))
    nengo.Connection(a, nengo.Node(lambda t, x: x / factor, size_in=1), transform=factor)


def rates(max_rate: float) -> None:
    kind = nengo.LIF(tau_ref=0.0001)
    nengo.Probe(nengo.Ensemble(20, 1, neuron_type=kind, max_rates=nengo.dists.Choice([max_rate])))


def biased(bias_hz: float) -> None:
    """Add neurons that fire at the rate of their bias."""
    kind, ones = nengo.SpikingRectifiedLinear(), np.ones(20)
    nengo.Probe(nengo.Ensemble(20, 1, neuron_type=kind, gain=ones, bias=bias_hz * ones))


def driven(by: float = 3.0, radius: float = 1.0, against: float = 0.0) -> None:
    a = nengo.Ensemble(20, 1, radius=radius)
    nengo.Connection(nengo.Node(lambda t: by * (t > 0.05)), a)
    nengo.Connection(nengo.Node(lambda t: against * (t > 0.05)), a)
    nengo.Probe(a)


def inhibited(synapse_s: float) -> None:
    """Add values and spikes that reach the same neurons."""
    a, b = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
    nengo.Connection(a, b, synapse=0.1)
    nengo.Connection(a.neurons, b.neurons, transform=-np.eye(20) / 1000, synapse=synapse_s)


def loop(synapse_s: float, gain: float = 1.0) -> None:
    a = nengo.Ensemble(20, 1)
    nengo.Connection(nengo.Node([1]), a)
    nengo.Connection(a, a, synapse=synapse_s, transform=gain)


def wired_loop(path: str, synapse_s: float = 0.005) -> None:
    """Add a loop of 5 ms, and set its decode path."""
    a = nengo.Ensemble(20, 1)
    nengo.Connection(nengo.Node([1]), a)
    back = nengo.Connection(a, a, synapse=synapse_s)
    network = nengo.Network.context[-1]
    spikeport.add_params(network)
    network.config[back].decode_path = path


def over_host(on_chip: bool = True) -> None:
    """Add a loop through a node, beside an ensemble that stays on the chip."""
    a, node = nengo.Ensemble(20, 1), nengo.Node(lambda t, x: 0.5 * x, size_in=1)
    nengo.Connection(a, node, synapse=0.1)
    nengo.Connection(node, a, synapse=None)
    nengo.Probe(nengo.Ensemble(20, 1))
    config = nengo.Network.context[0].config
    nengo_loihi.add_params(nengo.Network.context[0])
    config[a].on_chip = on_chip


def probed(attribute: str | None) -> None:
    a = nengo.Ensemble(20, 1)
    nengo.Probe(a.neurons if attribute else a, attribute)


def wired_pair() -> None:
    """Add 2 ensembles whose weights, neuron to neuron, take one core more than a relay."""
    pre, post = nengo.Ensemble(400, 1), nengo.Ensemble(400, 1)
    nengo.Connection(pre, post)
    nengo.Probe(post)


def relayed_pair(path: str = "auto") -> None:
    """Add 2 small ensembles, and set the decode path between them."""
    between = nengo.Connection(nengo.Ensemble(60, 1), nengo.Ensemble(60, 1))
    network = nengo.Network.context[-1]
    spikeport.add_params(network)
    network.config[between].decode_path = path


def moving_pair() -> None:
    """Add 2 ensembles with a relay between them, which loses more if it has few neurons."""
    pre, post = nengo.Ensemble(50, 1), nengo.Ensemble(50, 1)
    nengo.Connection(nengo.Node(lambda t: np.sin(20 * t)), pre)
    nengo.Connection(pre, post)
    nengo.Probe(post, synapse=0.02)


def compared(make: Callable[[], object], passes: str, loss_s: float | None = None) -> Check:
    """Return a check of the hints of a comparison with the network as written."""

    def check() -> set[str]:
        network = network_of(make)
        found = compile_network(network, pipeline=passes)
        written = as_written(network, "loihi", passes)
        if written is None:
            return set()
        hints = [*more_cores(found, written)]
        if loss_s is not None:
            errors = [network_error(network, one, loss_s, 0) for one in (found, written)]
            hints += more_loss(*errors)
        return {one.id for one in hints}

    return check


def learned(
    radius: float = 1.0, amplitude: float = 1.0, times: float = 1.0, rule: bool = True
) -> nengo.Probe:
    """Add a connection from the chip that learns half of full scale, and probe its values."""
    source, end = nengo.Node(radius / 2), nengo.Node(size_in=1)
    error = nengo.Node(lambda t, x: x, size_in=1)
    kind = nengo.LIF(amplitude=amplitude)
    a = nengo.Ensemble(60, 1, radius=radius, neuron_type=kind, label="a")
    nengo.Connection(source, a, synapse=None)
    rate = times * 2e-4 / amplitude**2
    pes = nengo.PES(rate) if rule else None
    learns = nengo.Connection(a, end, function=lambda x: 0 * x, learning_rule_type=pes)
    if rule:
        nengo.Connection(end, error)
        nengo.Connection(source, error, transform=-1 / radius)
        nengo.Connection(error, learns.learning_rule)
    return nengo.Probe(end, synapse=0.02)


def learning(rate: float, pre_tau_s: float) -> None:
    """Add a connection from the chip that learns slowly."""
    end = nengo.Node(lambda t, x: None, size_in=1)
    pes = nengo.PES(rate, pre_synapse=pre_tau_s)
    learns = nengo.Connection(nengo.Ensemble(60, 1), end, learning_rule_type=pes)
    nengo.Connection(nengo.Node(0.5), learns.learning_rule)


def unlike_nengo(radius: float, amplitude: float, times: float) -> Check:
    """Return a check of what was learned with another rate, against float Nengo without it."""

    def check() -> set[str]:
        values = []
        for backend, factor in (("reference", 1.0), ("native", times)):
            network = network_of(partial(learned, radius, amplitude, factor))
            (probe,) = network.all_probes
            with spikeport.Simulator(network, backend=backend, pipeline="as_written") as sim:
                sim.run(0.3)
                values.append(sim.data[probe][100::50, 0])
        return {"SP420"} if abs(values[1] - values[0]).max() > 0.1 else set()

    return check


def into_neurons(value: float, scale: float) -> None:
    """Add a constant that is sent into neurons."""
    a = nengo.Ensemble(20, 1)
    nengo.Connection(nengo.Node([value]), a.neurons, transform=np.full((20, 1), scale))


CASES = [
    Case(
        "SP409",
        "give one synapse to all connections that reach its neurons as spikes, of 5 ms",
        hinted(partial(inhibited, 0.02)),
        (hinted(partial(inhibited, 0.005)),),
    ),
    Case(
        "SP410",
        "compile with `-p compact`",
        hinted(partial(loop, 0.1)),
        (
            hinted(partial(loop, 0.1), "compact"),
            hinted(partial(loop, 0.005), "compact"),
            hinted(partial(loop, 0.011), "decode_path{default=onoff}"),
        ),
    ),
    Case(
        "SP410",
        "if it leads from an ensemble to an ensemble, wire it neuron to neuron",
        hinted(partial(wired_loop, "onoff"), "compact"),
        (
            hinted(partial(wired_loop, "direct"), "compact"),
            hinted(partial(wired_loop, "onoff", 0.011), "compact"),
        ),
    ),
    Case(
        "SP411",
        "compile with `-p as_written`",
        compared(wired_pair, "compact"),
        (compared(wired_pair, "as_written"),),
    ),
    Case(
        "SP412",
        "compile with `-p as_written`",
        compared(moving_pair, "decode_path{default=onoff}", 0.3),
        (compared(moving_pair, "as_written", 0.3),),
    ),
    Case(
        "SP401",
        "probe it, or give it a function",
        hinted(dead_end),
        (hinted(partial(dead_end, probe=True)), hinted(partial(dead_end, function=True))),
    ),
    Case(
        "SP402",
        "remove the connection, or look for a transform or function",
        hinted(partial(decoded, 0)),
        (hinted(partial(decoded, 0, connected=False)), hinted(partial(decoded, 1))),
    ),
    Case(
        "SP403",
        "bring the block's weights closer together: intercepts of at most 0.8, or a strong input",
        lambda: hinted(partial(steep, 0.95))() & hinted(partial(strong, 1))(),
        (hinted(partial(steep, 0.8)), hinted(partial(strong, 20))),
    ),
    Case(
        "SP403",
        "scale rows, `-p scale_rows,as_written`",
        hinted(strong_neuron),
        (hinted(strong_neuron, passes="scale_rows"),),
    ),
    Case(
        "SP403",
        "compile it with `-p compact`",
        hinted(strong_neuron),
        (hinted(strong_neuron, passes="compact"),),
    ),
    Case(
        "SP404",
        "draw encoders, gains and biases at random, or use fewer neurons",
        hinted(partial(alike, 10)),
        (hinted(partial(alike, 10, random=True)), hinted(partial(alike, 1))),
    ),
    Case(
        "SP405",
        "lower their intercepts or raise their gain, or use fewer neurons",
        hinted(idle),
        (
            hinted(partial(idle, bias=2.0)),
            hinted(partial(idle, gain=1.5)),
            hinted(partial(idle, n=5)),
        ),
    ),
    Case(
        "SP406",
        "divide what is decoded by its full scale, or by more",
        measured(partial(read_out, 30)),
        (measured(partial(read_out, 1)), measured(partial(read_out, 0.5))),
    ),
    Case(
        "SP407",
        "lower the maximum rates, or, from Python, take a shorter dt",
        measured(partial(rates, 900)),
        (measured(partial(rates, 50)), measured(partial(rates, 900), dt_s=0.0001)),
    ),
    Case(
        "SP408",
        "widen the ensemble's radius beyond the input's largest value, or scale the input down, "
        "or, if inputs of opposite signs cancel, compile with `-p compact`, which sends their sum",
        measured(partial(driven, against=-2.5)),
        (
            measured(partial(driven, radius=4.0, against=-2.5)),
            measured(partial(driven, by=0.8)),
            measured(partial(driven, against=-2.5), passes="compact"),
        ),
    ),
    Case(
        "SP408",
        "let a spike stand for more: `-p sparse_inputs,as_written` sends values of up to 2 radii",
        measured(driven),
        (
            measured(partial(driven, by=1.8), passes="sparse_inputs,as_written"),
            measured(driven, passes="sparse_inputs{weight=4},as_written"),
        ),
    ),
    Case(
        "SP413",
        "lower the loop's gain, for example with transform=0.9",
        hinted(partial(loop, 0.1)),
        (hinted(partial(loop, 0.1, gain=0.9)),),
    ),
    Case(
        "SP415",
        "replace its nodes, if it has any, by connections between ensembles",
        hinted(over_host),
        (hinted(partial(loop, 0.1)), hinted(partial(over_host, on_chip=False))),
    ),
    Case(
        "SP414",
        "probe spikes or decoded values",
        lambda: hinted(partial(probed, "voltage"))() & hinted(partial(probed, "input"))(),
        (hinted(partial(probed, "output")), hinted(partial(probed, None))),
    ),
    Case(
        "SP416",
        "give a connection of the loop a synapse",
        hinted(partial(looped, None)),
        (hinted(partial(looped, nengo.Lowpass(0.001))),),
    ),
    Case(
        "SP417",
        "lower the maximum rates, or, from Python, take a shorter dt",
        hinted(partial(from_host, nengo.SpikingRectifiedLinear(), bias=2500)),
        (
            hinted(partial(from_host, nengo.SpikingRectifiedLinear(), bias=900)),
            hinted(partial(from_host, nengo.SpikingRectifiedLinear(), bias=2500), dt_s=0.0002),
            hinted(partial(from_host, nengo.LIF(), bias=2500)),
        ),
    ),
    Case(
        "SP418",
        "compare with nengo_loihi.LoihiSpikingRectifiedLinear",
        hinted(partial(rectified, nengo.SpikingRectifiedLinear())),
        (
            hinted(partial(rectified, nengo_loihi.LoihiSpikingRectifiedLinear())),
            hinted(partial(rectified, nengo.LIF())),
        ),
    ),
    Case(
        "SP419",
        "raise `slack_cores` of the pass `decode_path`",
        hinted(relayed_pair, "decode_path{slack_cores=0}"),
        (
            hinted(relayed_pair, "decode_path"),
            hinted(partial(relayed_pair, "preset10"), "decode_path{slack_cores=0}"),
        ),
    ),
    Case(
        "SP420",
        "if its learning_rate was not chosen for the chip, multiply it by {factor}",
        lambda: (
            hinted(partial(learned, 4.0))()
            & hinted(partial(learned, amplitude=3.0))()
            & unlike_nengo(4.0, 1.0, 1.0)()
            & unlike_nengo(1.0, 3.0, 1.0)()
        ),
        (
            hinted(learned),
            hinted(partial(learned, 4.0, rule=False)),
            unlike_nengo(1.0, 1.0, 1.0),
            unlike_nengo(4.0, 1.0, 0.25),
            unlike_nengo(0.25, 1.0, 4.0),
            unlike_nengo(1.0, 3.0, 9.0),
        ),
    ),
    Case(
        "SP421",
        "if values go beyond the limit, divide them by their full scale",
        hinted(partial(into_neurons, 3.0, 1.0)),
        (hinted(partial(into_neurons, 1.0, 3.0)),),
    ),
    Case(
        "SP422",
        "raise its learning_rate, or take a shorter pre_synapse",
        lambda: hinted(partial(learning, 5e-7, 0.005))() & hinted(partial(learning, 5e-5, 0.5))(),
        (hinted(partial(learning, 5e-5, 0.005)), hinted(partial(learning, 5e-7, 0.001))),
    ),
    Case(
        "SP423",
        "connect fewer neurons, or lower the weights",
        hinted(partial(silenced_by, 400, -1.0)),
        (hinted(partial(silenced_by, 100, -1.0)), hinted(partial(silenced_by, 400, -0.01))),
    ),
    Case(
        "SP424",
        "lower the maximum rates, or gains and biases, or, from Python, take a shorter dt",
        lambda: hinted(partial(rates, 3000))() & hinted(partial(biased, 3000.0))(),
        (
            hinted(partial(rates, 300)),
            hinted(partial(biased, 300.0)),
            hinted(partial(rates, 3000), dt_s=0.0002),
        ),
    ),
    Case(
        "SP425",
        "compile with `-p compact`, or with `-p decode_path,as_written`",
        hinted(partial(relayed_pair, "direct")),
        (
            hinted(partial(relayed_pair, "direct"), "compact"),
            hinted(partial(relayed_pair, "direct"), "decode_path,as_written"),
        ),
    ),
    Case(
        "SP426",
        "decode more neurons, or neurons with higher maximum rates, or divide what is decoded by "
        "{factor}, and multiply on the host",
        hinted(slow),
        (
            hinted(partial(slow, n=50)),
            hinted(partial(slow, rate_hz=200.0)),
            hinted(partial(slow, factor=1 / 4)),
        ),
    ),
]
