import contextlib
from collections.abc import Callable
from typing import Any

import nengo
import nengo_loihi
import numpy as np
import pytest
from nengo.exceptions import BuildError

from spikeport.compile.check.lint import RULES, lint
from spikeport.compile.check.violation import DoesNotFitError, Violation
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.scope import Scope
from spikeport.compile.pipeline import compile_network
from tests.helpers.small_networks import scope_of

HOST = (
    "or keep it on the host with net.config[ensemble].on_chip = False, after "
    "spikeport.add_params(net)"
)
OVER_HOST = (
    'or send decoded values over the host: `network.config[connection].decode_path = "host"`, '
    "after `spikeport.add_params(network)` and with `-p compact`"
)
NEURONS = (
    "a: SP002 neuron type: {}, limit LIF, SpikingRectifiedLinear or RegularSpiking of LIFRate or "
    f"RectifiedLinear; cure: choose one of these, {HOST}"
)
GAIN = (
    "a: SP004 gain and bias: {} only, limit both or neither; cure: set both, or set max_rates and "
    "intercepts instead"
)
PART = (
    "a -> b: SP006 slice of an on-chip target: {} of 8 neurons, limit all; cure: give these "
    "neurons an ensemble of their own"
)
RULE = (
    "a -> out: SP007 learning rule: {}, limit one PES; cure: learn with PES, passed by itself as "
    "in learning_rule_type=nengo.PES(), or keep the ensemble it learns from on the host with "
    "net.config[ensemble].on_chip = False, after spikeport.add_params(net)"
)
LEAVE = "or leave the probe out, so that the probed object stays on the chip"
BOARD = (
    "{}: SP009 node on the chip: {}, limit events of a file, to ensembles on the chip; cure: feed "
    "the events from a node on the host"
)
FINITE = (
    "{}: SP011 finite numbers: NaN or infinity in {}, limit finite numbers; cure: look for a "
    "division by zero, a root or logarithm out of range, or an overflow there"
)


FROM_HOST = (
    "a -> b: SP015 neurons on the host that feed the chip: {}, limit a type with spikes above "
    "zero; cure: take a type that spikes, as nengo.SpikingRectifiedLinear in place of "
    "nengo.RectifiedLinear, or nengo.RegularSpiking(nengo.Sigmoid())"
)
RLS, RECTIFIED = nengo.RLS(), nengo.RectifiedLinear()


class Eavesdropper(nengo.LIF):
    """A subclass of LIF, which nengo-loihi would build as plain LIF."""


def no_ensemble() -> None:
    nengo.Node(0.0)


def foreign_neuron_type() -> None:
    nengo.Ensemble(4, 1, label="a", neuron_type=nengo.AdaptiveLIF())


def foreign_regular_base() -> None:
    nengo.Ensemble(4, 1, label="a", neuron_type=nengo.RegularSpiking(nengo.Tanh()))


def subclass_of_a_neuron_type() -> None:
    nengo.Ensemble(4, 1, label="a", neuron_type=Eavesdropper())


def noise() -> None:
    nengo.Ensemble(4, 1, label="a", noise=nengo.processes.WhiteNoise())


def gain_without_bias() -> None:
    nengo.Ensemble(4, 1, label="a", gain=np.ones(4))


def bias_without_gain() -> None:
    nengo.Ensemble(4, 1, label="a", bias=np.ones(4))


def second_order_synapse() -> None:
    a = nengo.Ensemble(4, 1, label="a")
    nengo.Connection(a, a, synapse=nengo.Alpha(0.01))


def convolution_into_a_part(part: slice = slice(4, None)) -> None:
    a, b = nengo.Ensemble(16, 1, label="a"), nengo.Ensemble(8, 1, label="b")
    transform = nengo.Convolution(1, (4, 4, 1), strides=(2, 2), kernel_size=(2, 2))
    nengo.Connection(a.neurons, b.neurons[part], transform=transform)


def convolution_of_one_neuron_twice() -> None:
    a, b = nengo.Ensemble(16, 1, label="a"), nengo.Ensemble(4, 1, label="b")
    transform = nengo.Convolution(1, (4, 4, 1), strides=(2, 2), kernel_size=(2, 2))
    nengo.Connection(a.neurons[[0, *range(15)]], b.neurons, transform=transform)


def foreign_learning_rule(rule: Any = RLS) -> None:
    a, out = nengo.Ensemble(4, 1, label="a"), nengo.Node(size_in=1, label="out")
    nengo.Connection(a, out, learning_rule_type=rule)


def learning_to_neurons() -> None:
    a, b = nengo.Ensemble(4, 1, label="a"), nengo.Ensemble(8, 1, label="b")
    nengo.Connection(a, b.neurons, transform=np.zeros((8, 1)), learning_rule_type=nengo.PES())


def learning_full_weights() -> None:
    a, b = nengo.Ensemble(4, 1, label="a"), nengo.Ensemble(8, 1, label="b")
    solver = nengo.solvers.LstsqL2(weights=True)
    nengo.Connection(a, b, solver=solver, learning_rule_type=nengo.PES())


def direct_loop() -> None:
    nengo.Ensemble(4, 1)
    a, b = (nengo.Node(lambda t, x: x / 2, size_in=1, label=label) for label in "ab")
    nengo.Connection(a, b, synapse=None)
    nengo.Connection(b, a, synapse=None)


def setting_of_an_inner_network() -> None:
    with nengo.Network(label="inner") as inner:
        nengo_loihi.add_params(inner)
        inner.config[nengo.Ensemble(4, 1, label="a")].on_chip = False


def list_of_rules() -> None:
    foreign_learning_rule([nengo.PES()])


def dict_of_rules() -> None:
    foreign_learning_rule({"a": nengo.PES(), "b": nengo.RLS()})


def convolution_of_decoded_values() -> None:
    plane = nengo.transforms.ConvolutionTranspose(1, (2, 2, 1), kernel_size=(2, 2))
    a = nengo.Ensemble(20, 4, label="a")
    nengo.Connection(a, nengo.Node(size_in=plane.size_out, label="b"), transform=plane)


def decoders_of_another_shape() -> None:
    a, b = nengo.Ensemble(4, 1, label="a"), nengo.Ensemble(8, 1, label="b")
    nengo.Connection(a, b, solver=nengo.solvers.NoSolver(np.zeros((4, 8)), weights=True))


class LiveCamera(nengo_loihi.dvs.DVSFileChipProcess):
    """A process on the board that reads a camera, not a file."""


def process_on_the_board(camera: type = LiveCamera) -> nengo.Node:
    a = nengo.Ensemble(4, 1, label="a")
    events = nengo.Node(camera("recording.aedat"), label="events")
    nengo.Connection(events[:4], a.neurons)
    return events


def events_to_the_host() -> None:
    events = process_on_the_board(nengo_loihi.dvs.DVSFileChipProcess)
    nengo.Connection(events[0], nengo.Node(size_in=1, label="out"))


def probed_events() -> None:
    events = process_on_the_board(nengo_loihi.dvs.DVSFileChipProcess)
    nengo.Probe(events, label="p")


def infinite_gain() -> None:
    nengo.Ensemble(4, 1, label="a", gain=[1, 1, 1, np.inf], bias=np.ones(4))


def undefined_encoders() -> None:
    nengo.Ensemble(4, 1, label="a", encoders=np.full((4, 1), np.nan))


def undefined_evaluation_points() -> None:
    nengo.Ensemble(4, 1, label="a", eval_points=[[0.0], [np.nan]])


def undefined_transform() -> None:
    a, b = (nengo.Ensemble(4, 1, label=label) for label in "ab")
    nengo.Connection(a, b, transform=np.nan)


def infinite_targets() -> None:
    a, b = (nengo.Ensemble(4, 1, label=label) for label in "ab")
    nengo.Connection(a, b, eval_points=np.ones((3, 1)), function=[[1.0], [2.0], [np.inf]])


def foreign_probe() -> None:
    nengo.Probe(nengo.Ensemble(4, 1, label="a"), "scaled_encoders", label="p")


def refractory_probe() -> None:
    nengo.Probe(nengo.Ensemble(4, 1, label="a").neurons, "refractory_time", label="p")


def probed_connection() -> None:
    a = nengo.Ensemble(4, 1, label="a")
    nengo.Probe(nengo.Connection(a, a), label="p")


def host_neurons(kind: nengo.neurons.NeuronType = RECTIFIED) -> None:
    nengo_loihi.add_params(network := nengo.Network.context[-1])
    a, b = nengo.Ensemble(4, 1, label="a", neuron_type=kind), nengo.Ensemble(4, 1, label="b")
    network.config[a].on_chip = False
    nengo.Connection(a.neurons, b.neurons, transform=0.001)


def host_neurons_below_zero() -> None:
    host_neurons(nengo.RegularSpiking(nengo.Tanh()))


CASES: list[tuple[Callable[[], None], str]] = [
    (
        no_ensemble,
        "network: SP001 on-chip ensembles: 0, limit at least 1; cure: add an ensemble of spiking "
        "neurons that is not marked on_chip = False, and not a target or error source of learning",
    ),
    (foreign_neuron_type, NEURONS.format("AdaptiveLIF")),
    (foreign_regular_base, NEURONS.format("RegularSpiking")),
    (subclass_of_a_neuron_type, NEURONS.format("Eavesdropper")),
    (
        noise,
        f"a: SP003 ensemble noise: WhiteNoise, limit none; cure: remove the noise, {HOST}",
    ),
    (gain_without_bias, GAIN.format("gain")),
    (bias_without_gain, GAIN.format("bias")),
    (
        second_order_synapse,
        "a -> a: SP005 synapse: Alpha, limit Lowpass or None; cure: use nengo.Lowpass(0.02) with "
        f"the same group delay, {OVER_HOST}",
    ),
    (convolution_into_a_part, PART.format(4)),
    (
        convolution_of_one_neuron_twice,
        "a -> b: SP014 values that a convolution reads: 16 of 15 neurons, limit each neuron once; "
        "cure: multiply the convolution out, and connect with nengo.Sparse",
    ),
    (
        convolution_of_decoded_values,
        "a -> b: SP020 source of a convolution: ConvolutionTranspose of decoded values, limit "
        "neurons or a node; cure: convolve from the ensemble's neurons, as in "
        "nengo.Connection(ensemble.neurons, target, transform=nengo.Convolution(...))",
    ),
    (
        decoders_of_another_shape,
        "a -> b: SP013 shape of the user's decoders: (4, 8), limit (4, 1); cure: give "
        "nengo.solvers.NoSolver a row for each neuron, and a column for each value of the "
        "connection's function; the same holds with weights=True",
    ),
    (foreign_learning_rule, RULE.format("RLS")),
    (list_of_rules, RULE.format("list of PES")),
    (
        learning_to_neurons,
        "a -> b: SP016 target of learning: neurons, limit an ensemble or node; cure: let the "
        "learning connection end in a node, as in nengo.Connection(ensemble, node, "
        "learning_rule_type=nengo.PES()), and connect the node to the neurons, or keep the "
        "ensemble it learns from on the host with net.config[ensemble].on_chip = False, after "
        "spikeport.add_params(net)",
    ),
    (
        learning_full_weights,
        "a -> b: SP018 solver of a connection to the host: full weights, limit decoders; cure: "
        "leave weights=True out of its solver, or keep its source on the host, too, with "
        "net.config[ensemble].on_chip = False, after spikeport.add_params(net)",
    ),
    (
        direct_loop,
        "b -> a: SP017 loop on the host without a synapse: none, limit a synapse in each loop; "
        "cure: give a connection of the loop a synapse, as in "
        "synapse=nengo.Lowpass(0.001), or synapse=0, which is one step of delay",
    ),
    (
        setting_of_an_inner_network,
        "inner.a: SP019 setting in another config: on_chip in the config of inner, limit in the "
        "config of the outermost network; cure: set it in the config that the message names as "
        "its limit, after spikeport.add_params on that network",
    ),
    (dict_of_rules, RULE.format("dict of PES, RLS")),
    (
        process_on_the_board,
        BOARD.format("events", "LiveCamera"),
    ),
    (events_to_the_host, BOARD.format("events -> out", "to the host")),
    (
        probed_events,
        "p: SP010 probed attribute: output of events, limit no attribute of a node on the chip; "
        f"cure: probe what the node feeds, {LEAVE}, {HOST}",
    ),
    (
        foreign_probe,
        "p: SP010 probed attribute: scaled_encoders of a, limit decoded_output; cure: probe one of "
        f"these, {LEAVE}, {HOST}",
    ),
    (
        refractory_probe,
        "p: SP010 probed attribute: refractory_time of a, limit output or voltage or input; cure: "
        f"probe one of these, {LEAVE}, {HOST}",
    ),
    (
        probed_connection,
        "p: SP010 probed attribute: output of a -> a, limit no attribute of a connection; cure: "
        f"probe an end of the connection, {LEAVE}, {HOST.replace('it', 'a', 1)}",
    ),
    (infinite_gain, FINITE.format("a", "gain")),
    (undefined_encoders, FINITE.format("a", "encoders")),
    (undefined_evaluation_points, FINITE.format("a", "eval_points")),
    (undefined_transform, FINITE.format("a -> b", "transform")),
    (infinite_targets, FINITE.format("a -> b", "function")),
    (host_neurons, FROM_HOST.format("RectifiedLinear, which does not spike")),
    (host_neurons_below_zero, FROM_HOST.format("RegularSpiking, with negative spikes")),
]


@pytest.mark.parametrize(
    ("synapse", "tau_s"),
    [
        (nengo.Alpha(0.02), "0.04"),
        (nengo.LinearFilter([-0.01, 1], [0.02, 1]), "0.03"),
        (nengo.LinearFilter([1, 0], [0.02, 1]), "tau"),  # a high-pass filter
        (nengo.LinearFilter([1], [1, 0]), "tau"),  # an integrator
        (nengo.Triangle(0.03), "0.01"),
    ],
)
def test_the_cure_for_a_synapse_is_a_lowpass_of_the_same_group_delay(
    synapse: Any, tau_s: str
) -> None:
    def make() -> None:
        nengo.Connection(nengo.Ensemble(5, 1), nengo.Ensemble(5, 1), synapse=synapse)

    (violation,) = violations(make)
    assert violation.cure == f"use nengo.Lowpass({tau_s}) with the same group delay, {OVER_HOST}"


def test_the_cure_for_a_synapse_of_full_weights_does_not_suggest_the_host() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(4, 1), nengo.Ensemble(4, 1)
        solver = nengo.solvers.LstsqL2(weights=True)
        nengo.Connection(a, b, synapse=nengo.Alpha(0.01), solver=solver)
    (found,) = lint(scope_of(network))
    assert found.id == "SP005"
    assert OVER_HOST not in str(found)


def test_the_cure_for_a_synapse_between_neurons_does_not_suggest_the_host() -> None:
    def make() -> None:
        ends = (nengo.Ensemble(5, 1).neurons, nengo.Ensemble(5, 1).neurons)
        nengo.Connection(*ends, synapse=nengo.Triangle(0.03))

    (violation,) = violations(make)
    assert violation.cure == "use nengo.Lowpass(0.01) with the same group delay"


def violations(make: Callable[[], Any]) -> list[Violation]:
    with nengo.Network(seed=1) as network:
        make()
    return lint(scope_of(network))


@pytest.mark.parametrize(("make", "expected"), CASES, ids=[make.__name__ for make, _ in CASES])
def test_a_broken_rule_is_reported(make: Callable[[], None], expected: str) -> None:
    assert [str(violation) for violation in violations(make)] == [expected]


def test_every_rule_is_broken_by_a_case() -> None:
    broken = set()
    for make, _ in CASES:
        with nengo.Network(seed=1) as network:
            make()
        scope = Scope(network, Names(network))
        broken |= {rule for rule in RULES if list(rule(scope))}
    assert broken == set(RULES)


def test_values_that_an_ensemble_computes_without_neurons_may_be_convolved() -> None:
    plane = nengo.Convolution(1, (2, 2, 1), kernel_size=(2, 2))
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        direct = nengo.Ensemble(1, 4, neuron_type=nengo.Direct())
        network.config[direct].on_chip = False
        nengo.Connection(direct, nengo.Node(size_in=plane.size_out), transform=plane)
        nengo.Ensemble(5, 1)
    assert lint(scope_of(network)) == []
    compile_network(network)


def test_all_violations_are_reported_at_once() -> None:
    def make() -> None:
        foreign_neuron_type()
        noise()
        probed_connection()

    assert [(v.object, v.rule) for v in violations(make)] == [
        ("a", "neuron type"),
        ("a#2", "ensemble noise"),
        ("p", "probed attribute"),
    ]


def test_the_error_lists_each_violation_in_a_row() -> None:
    with nengo.Network(seed=1) as network:
        noise()
        probed_connection()
        nengo.Ensemble(10, 1)
    with pytest.raises(DoesNotFitError) as raised:
        compile_network(network)
    assert raised.value.violations == tuple(lint(scope_of(network)))
    assert str(raised.value) == (
        "the network does not fit chip 'loihi':\n"
        "  a: SP003 ensemble noise: WhiteNoise, limit none; cure: remove the noise, or keep it on "
        "the host with net.config[ensemble].on_chip = False, after spikeport.add_params(net)\n"
        "  p: SP010 probed attribute: output of a#2 -> a#2, limit no attribute of a connection; "
        f"cure: probe an end of the connection, {LEAVE}, or keep a#2 on the host with "
        "net.config[ensemble].on_chip = False, after spikeport.add_params(net)\n"
        "more: spikeport compile --explain SP003\n"
        "more: try --offload, which moves ensembles that are refused to the host"
    )


def test_a_clean_network_breaks_no_rule(chain: Callable[..., nengo.Network]) -> None:
    network = chain()
    assert lint(scope_of(network)) == []


@pytest.mark.parametrize(
    "kind",
    [
        nengo.LIF(),
        nengo.SpikingRectifiedLinear(),
        nengo.RegularSpiking(nengo.LIFRate()),
        nengo.RegularSpiking(nengo.RectifiedLinear()),
        nengo_loihi.LoihiLIF(),
        nengo_loihi.LoihiSpikingRectifiedLinear(),
    ],
    ids=repr,
)
def test_neuron_types_of_the_chip_are_accepted_and_built(kind: nengo.neurons.NeuronType) -> None:
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(4, 1, neuron_type=kind)
    assert compile_network(network).image.n_compartments == 4


def test_ensembles_kept_on_the_host_are_exempt() -> None:
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        chip = nengo.Ensemble(4, 1)
        host = nengo.Ensemble(4, 2, neuron_type=nengo.AdaptiveLIF(), gain=np.ones(4))
        network.config[host].on_chip = False
        nengo.Ensemble(1, 1, neuron_type=nengo.Direct())
        nengo.Connection(chip, host[0], synapse=nengo.Alpha(0.01))
        nengo.Probe(host, "scaled_encoders", sample_every=0.01)
    assert lint(scope_of(network)) == []


def test_targets_and_error_sources_of_learning_are_exempt() -> None:
    with nengo.Network(seed=1) as network:
        pre = nengo.Ensemble(10, 1, label="pre")
        target, error = (
            nengo.Ensemble(10, 2, neuron_type=nengo.LIFRate(), label=label)
            for label in ("target", "error")
        )
        learned = nengo.Connection(pre, target[0], learning_rule_type=nengo.PES())
        nengo.Connection(pre, error[1])
        nengo.Connection(error[0], learned.learning_rule)
        nengo.Probe(error, sample_every=0.01)
    assert lint(scope_of(network)) == []
    image = compile_network(network).image
    owners = {block.owner for block in image.manifest.blocks}
    assert not owners & {"target", "error"}
    assert "pre" in owners
    assert image.groups.learning[:, 0].sum() == 1


def test_synapses_to_and_from_the_host_may_be_of_any_kind() -> None:
    with nengo.Network(seed=1) as network:
        u, out = nengo.Node(0.0), nengo.Node(size_in=1)
        a = nengo.Ensemble(4, 1)
        nengo.Connection(u, a, synapse=nengo.Alpha(0.01))
        nengo.Connection(a, out, synapse=nengo.Alpha(0.01))
    assert lint(scope_of(network)) == []


def test_a_connection_with_full_weights_may_reach_part_of_an_ensemble() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(10, 1), nengo.Ensemble(10, 2)
        nengo.Connection(a, b[0], solver=nengo.solvers.LstsqL2(weights=True))
    assert lint(scope_of(network)) == []
    assert compile_network(network).image.n_blocks == 2


def test_a_network_with_all_ensembles_on_the_host_is_reported_with_reasons() -> None:
    def make() -> None:
        nengo_loihi.add_params(network := nengo.Network.context[-1])
        target, error, marked = (nengo.Ensemble(4, 1) for _ in range(3))
        learned = nengo.Connection(nengo.Node(1.0), target, learning_rule_type=nengo.Voja())
        nengo.Connection(error, learned.learning_rule)
        network.config[marked].on_chip = False
        nengo.Ensemble(1, 1, neuron_type=nengo.Direct())

    assert [(one.id, one.used) for one in violations(make)] == [
        (
            "SP001",
            "0 of 4: 2 kept on the host by nengo-loihi, as a target or error source of learning, "
            "1 with on_chip = False, 1 of neuron type Direct",
        )
    ]


@pytest.mark.parametrize(
    ("read", "function", "through"),
    [
        (slice(0, 1), None, False),
        (slice(1, 2), None, True),
        ([0], None, True),  # Nengo treats a list as all entries
        (slice(0, 4, 3), None, True),  # and a step as all entries between
        (slice(0, 1), lambda t, x: x, True),
    ],
)
def test_a_loop_on_the_host_is_reported_exactly_if_nengo_refuses_it(
    read: slice | list[int], function: Callable[[float, Any], Any] | None, through: bool
) -> None:
    def make() -> None:
        a, b = nengo.Node(function, size_in=4), nengo.Node(function, size_in=4)
        nengo.Connection(
            a[read], b[:1], transform=np.ones((1, len(np.arange(4)[read]))), synapse=None
        )
        nengo.Connection(b[:1], a[1:2], synapse=None)
        nengo.Connection(nengo.Ensemble(10, 1), b[0])

    assert [one.id for one in violations(make)] == ["SP017"] * through
    with nengo.Network() as network:
        make()
    with pytest.raises(BuildError, match="cycles") if through else contextlib.nullcontext():
        nengo.Simulator(network, progress_bar=False).close()


def test_on_chip_set_for_all_ensembles_of_an_inner_network_is_reported() -> None:
    def make() -> None:
        with nengo.Network(label="inner") as inner:
            nengo_loihi.add_params(inner)
            inner.config[nengo.Ensemble].on_chip = False
            inner.config[nengo.Connection].pop_type = 16
            nengo.Ensemble(4, 1)

    found = [(one.id, one.object, one.used) for one in violations(make)]
    assert found == [("SP019", "inner", "on_chip in the config of inner")]
