"""Cures for the rules of networks, SP0xx."""

from functools import partial

import nengo
import numpy as np
from nengo.neurons import NeuronType
from nengo.synapses import Synapse
from nengo_loihi.inputs import ChipProcess

from spikeport import add_params
from tests.helpers.cured import Case, compiled, linted, on_host


class Camera(ChipProcess):
    """A process on the board."""

    def __init__(self) -> None:
        super().__init__(default_size_in=0, default_size_out=4)


def some(n: int) -> None:
    """Add ``n`` ensembles that stay on the chip."""
    for _ in range(n):
        nengo.Ensemble(4, 1)


def target_of_learning(more: int) -> None:
    learned = nengo.Connection(
        nengo.Node([1.0]), nengo.Ensemble(4, 1), learning_rule_type=nengo.Voja()
    )
    nengo.Connection(nengo.Node(0.0), learned.learning_rule)
    some(more)


def neurons(kind: NeuronType, host: bool = False) -> None:
    some(1)
    ensemble = nengo.Ensemble(4, 1, neuron_type=kind)
    if host:
        on_host(ensemble)


def noisy(noise: bool = False, host: bool = False, node: bool = False) -> None:
    some(1)
    process = nengo.processes.WhiteNoise(seed=1)
    ensemble = nengo.Ensemble(4, 1, noise=process if noise else None)
    if host:
        on_host(ensemble)
    if node:
        nengo.Connection(nengo.Node(process, size_out=1), ensemble)


def gains(**given: object) -> None:
    nengo.Ensemble(4, 1, **given)


def loop(synapse: Synapse) -> None:
    a = nengo.Ensemble(20, 1)
    nengo.Connection(a, a, synapse=synapse)


def from_node(synapse: Synapse) -> None:
    nengo.Connection(nengo.Node(0.5), nengo.Ensemble(20, 1), synapse=synapse)


def over_host() -> None:
    network = nengo.Network.context[-1]
    add_params(network)
    a = nengo.Ensemble(20, 1)
    network.config[nengo.Connection(a, a, synapse=nengo.Alpha(0.01))].decode_path = "host"


def convolved(n: int, sparse: bool = False, twice: bool = False) -> None:
    """Connect 4 x 4 pixels to the first 16 of n neurons, by a convolution with a single weight.

    If ``twice``, there are 15 source neurons, the first of which is the first two pixels.
    """
    alike = {"gain": nengo.dists.Choice([1.0]), "bias": nengo.dists.Choice([1.0])}
    pre, post = nengo.Ensemble(16, 1), nengo.Ensemble(n, 1, **alike)
    transform = nengo.Convolution(1, (4, 4, 1), kernel_size=(1, 1), init=np.full((1, 1, 1, 1), 0.1))
    if sparse:
        transform = nengo.Sparse((16, 16), indices=[(i, i) for i in range(16)], init=0.1)
    target = post.neurons if n == 16 else post.neurons[:16]
    pixels = [0, *range(15)] if twice else slice(None)
    nengo.Connection(pre.neurons[pixels], target, transform=transform)


def convolved_values(by: str) -> None:
    """Convolve the values of an ensemble as decoded ones, as spikes, or from a node on the host."""
    plane = nengo.Convolution(1, (4, 4, 1), kernel_size=(3, 3))
    alike = {"gain": nengo.dists.Choice([1.0]), "bias": nengo.dists.Choice([1.0])}
    a, target = nengo.Ensemble(16, 16), nengo.Ensemble(plane.output_shape.size, 1, **alike)
    source: object = a
    if by == "neurons":
        source = a.neurons
    if by == "node":
        on_host(target)
        source = nengo.Node(size_in=16)
        nengo.Connection(a, source)
    nengo.Connection(source, target.neurons, transform=plane)


def learned(
    rule: nengo.learning_rules.LearningRuleType, host: bool = False, n: int = 20, values: int = 1
) -> None:
    some(1)
    a, out = nengo.Ensemble(n, 1), nengo.Node(size_in=values)
    zeros = np.zeros(values)
    connection = nengo.Connection(a, out, function=lambda x: zeros, learning_rule_type=rule)
    nengo.Connection(out, connection.learning_rule)
    if host:
        on_host(a)


def learned_to_neurons(by_node: bool = False, host: bool = False) -> None:
    some(1)
    a, b = nengo.Ensemble(20, 1), nengo.Ensemble(3, 1)
    target = nengo.Node(size_in=3) if by_node else b.neurons
    connection = nengo.Connection(
        a, target, function=lambda x: np.zeros(3), learning_rule_type=nengo.PES()
    )
    error = nengo.Node(np.zeros(connection.learning_rule.size_in))
    nengo.Connection(error, connection.learning_rule)
    if by_node:
        nengo.Connection(target, b.neurons, synapse=None)
    on_host(b)
    if host:
        on_host(a)


def learned_in_full(weights: bool = True, host: bool = False) -> None:
    some(1)
    a = nengo.Ensemble(20, 1)
    solver = nengo.solvers.LstsqL2(weights=weights)
    target = nengo.Ensemble(20, 1)
    connection = nengo.Connection(a, target, solver=solver, learning_rule_type=nengo.PES())
    nengo.Connection(nengo.Node(0.0), connection.learning_rule)
    if host:
        on_host(a)


def host_loop(synapse: object = None) -> None:
    some(1)
    a, b = (nengo.Node(lambda t, x: x / 2, size_in=1) for _ in range(2))
    nengo.Connection(a, b, synapse=None)
    nengo.Connection(b, a, synapse=synapse)


def inner_setting(outermost: bool = False) -> None:
    some(1)
    with nengo.Network() as inner:
        ensemble = nengo.Ensemble(10, 1)
    network = nengo.Network.context[-1] if outermost else inner
    add_params(network)
    network.config[ensemble].on_chip = False


def in_list() -> None:
    rules = [nengo.PES()]
    nengo.Connection(nengo.Ensemble(20, 1), nengo.Node(size_in=1), learning_rule_type=rules)


def users_decoders(rows: int) -> None:
    solver = nengo.solvers.NoSolver(np.zeros((rows, 1)), weights=True)
    nengo.Connection(nengo.Ensemble(20, 1), nengo.Ensemble(10, 1), solver=solver)


def events(output: object) -> None:
    ensemble = nengo.Ensemble(4, 1)
    nengo.Connection(nengo.Node(output, size_out=4), ensemble.neurons, transform=0.1)


def probed(attribute: str | None = None, host: bool = False, connection: bool = False) -> None:
    some(1)
    a = nengo.Ensemble(4, 1)
    loop_ = nengo.Connection(a, a)
    nengo.Probe(loop_ if connection else a, attribute)
    if host:
        on_host(a)


def from_host(
    kind: NeuronType, decoded: bool = False, host: bool = False, bias: float = 80.0
) -> None:
    """Connect neurons on the host with some on the chip, or with some on the host, too."""
    some(1)
    alike = {"gain": np.ones(2), "bias": np.full(2, bias), "encoders": np.ones((2, 1))}
    a, b = nengo.Ensemble(2, 1, neuron_type=kind, **alike), nengo.Ensemble(2, 1)
    for ensemble in (a, b) if host else (a,):
        on_host(ensemble)
    if decoded:
        nengo.Connection(a, b)
    else:
        nengo.Connection(a.neurons, b.neurons, transform=0.001)


def divided(by: float) -> None:
    with np.errstate(divide="ignore"):
        nengo.Ensemble(4, 1, gain=np.ones(4) / np.full(4, by), bias=np.ones(4))


HOST_KIND, SIGMOID = nengo.RectifiedLinear(), nengo.Sigmoid()
ALPHA = nengo.Alpha(0.01)
CASES = [
    Case(
        "SP001",
        "add an ensemble of spiking neurons",
        linted(partial(target_of_learning, 0)),
        (linted(partial(target_of_learning, 1)),),
    ),
    Case(
        "SP002",
        "choose one of these, or keep it on the host",
        linted(partial(neurons, nengo.Izhikevich())),
        (
            linted(partial(neurons, nengo.LIF())),
            linted(partial(neurons, nengo.SpikingRectifiedLinear())),
            linted(partial(neurons, nengo.RegularSpiking(nengo.LIFRate()))),
            linted(partial(neurons, nengo.RegularSpiking(nengo.RectifiedLinear()))),
            linted(partial(neurons, nengo.Izhikevich(), host=True)),
        ),
    ),
    Case(
        "SP002",
        "take nengo.SpikingRectifiedLinear in place of",
        lambda: linted(partial(neurons, HOST_KIND))() & linted(partial(neurons, nengo.LIFRate()))(),
        (
            linted(partial(neurons, nengo.SpikingRectifiedLinear())),
            linted(partial(neurons, nengo.LIF())),
        ),
    ),
    Case(
        "SP003",
        "remove the noise, or keep it on the host",
        linted(partial(noisy, noise=True)),
        (linted(noisy), linted(partial(noisy, noise=True, host=True))),
    ),
    Case(
        "SP003",
        "add the noise from a node on the host",
        linted(partial(noisy, noise=True)),
        (linted(partial(noisy, node=True)),),
    ),
    Case(
        "SP004",
        "set both, or set max_rates and intercepts",
        linted(partial(gains, gain=np.ones(4))),
        (
            linted(partial(gains, gain=np.ones(4), bias=np.ones(4))),
            linted(partial(gains, max_rates=np.full(4, 100), intercepts=np.zeros(4))),
        ),
    ),
    Case(
        "SP005",
        "use nengo.Lowpass({tau_s})",
        linted(partial(loop, ALPHA)),
        (linted(partial(loop, nengo.Lowpass(0.02))),),
    ),
    Case(
        "SP005",
        "filter on the host: between a node and an ensemble",
        linted(partial(loop, ALPHA)),
        (linted(partial(from_node, ALPHA)),),
    ),
    Case(
        "SP005",
        "send decoded values over the host",
        linted(partial(loop, ALPHA)),
        (compiled(over_host, passes="compact"),),
    ),
    Case(
        "SP006",
        "give these neurons an ensemble of their own",
        linted(partial(convolved, 20)),
        (linted(partial(convolved, 16)),),
    ),
    Case(
        "SP006",
        "multiply the convolution out, and connect with nengo.Sparse",
        linted(partial(convolved, 20)),
        (linted(partial(convolved, 20, sparse=True)),),
    ),
    Case(
        "SP014",
        "multiply the convolution out, and connect with nengo.Sparse",
        linted(partial(convolved, 16, twice=True)),
        (
            linted(partial(convolved, 16)),
            compiled(partial(convolved, 16, sparse=True, twice=True)),
        ),
    ),
    Case(
        "SP007",
        "learn with PES, passed by itself",
        lambda: linted(partial(learned, nengo.RLS()))() & linted(in_list)(),
        (linted(partial(learned, nengo.PES())), linted(partial(learned, nengo.RLS(), host=True))),
    ),
    Case(
        "SP016",
        "let the learning connection end in a node",
        linted(learned_to_neurons),
        (
            linted(partial(learned_to_neurons, by_node=True)),
            linted(partial(learned_to_neurons, host=True)),
        ),
    ),
    Case(
        "SP018",
        "leave weights=True out of its solver, or keep its source on the host",
        linted(learned_in_full),
        (
            linted(partial(learned_in_full, weights=False)),
            linted(partial(learned_in_full, host=True)),
        ),
    ),
    Case(
        "SP017",
        "give a connection of the loop a synapse, as in synapse=nengo.Lowpass(0.001)",
        linted(host_loop),
        (linted(partial(host_loop, nengo.Lowpass(0.001))), linted(partial(host_loop, 0))),
    ),
    Case(
        "SP019",
        "set it in the config that the message names as its limit",
        linted(inner_setting),
        (linted(partial(inner_setting, outermost=True)),),
    ),
    Case(
        "SP009",
        "feed the events from a node on the host",
        linted(partial(events, Camera())),
        (linted(partial(events, lambda t: [1, 0, 0, 1])),),
    ),
    Case(
        "SP010",
        "probe {instead}, or leave the probe out, so that the probed object stays on the chip, or "
        "keep",
        linted(partial(probed, "scaled_encoders")),
        (
            linted(partial(probed, "decoded_output")),
            linted(probed),
            linted(partial(probed, "scaled_encoders", host=True)),
            linted(partial(probed, "weights", connection=True, host=True)),
        ),
    ),
    Case(
        "SP011",
        "look for a division by zero",
        linted(partial(divided, 0.0)),
        (linted(partial(divided, 2.0)),),
    ),
    Case(
        "SP012",
        "learn from fewer neurons, or fewer values, or keep the ensemble it learns from on the "
        "host",
        compiled(partial(learned, nengo.PES(), n=600, values=110)),
        (
            compiled(partial(learned, nengo.PES(), n=100, values=110)),
            compiled(partial(learned, nengo.PES(), n=600, values=20)),
            compiled(partial(learned, nengo.PES(), n=600, values=110, host=True)),
        ),
    ),
    Case(
        "SP013",
        "give nengo.solvers.NoSolver a row for each neuron",
        compiled(partial(users_decoders, 19)),
        (compiled(partial(users_decoders, 20)),),
    ),
    Case(
        "SP020",
        "convolve from the ensemble's neurons",
        linted(partial(convolved_values, "values")),
        (linted(partial(convolved_values, "neurons")),),
    ),
    Case(
        "SP020",
        "decode into a node, and convolve from the node",
        linted(partial(convolved_values, "values")),
        (linted(partial(convolved_values, "node")),),
    ),
    Case(
        "SP015",
        "take a type that spikes",
        lambda: linted(partial(from_host, HOST_KIND))() & linted(partial(from_host, SIGMOID))(),
        (
            linted(partial(from_host, nengo.SpikingRectifiedLinear())),
            linted(partial(from_host, nengo.RegularSpiking(SIGMOID))),
        ),
    ),
    Case(
        "SP015",
        "connect from the ensemble in place of its neurons",
        linted(partial(from_host, HOST_KIND)),
        (
            linted(partial(from_host, HOST_KIND, decoded=True)),
            linted(partial(from_host, HOST_KIND, host=True)),
        ),
    ),
]
