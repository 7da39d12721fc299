"""The identity of networks: equal if they compile to the same image, whatever nodes call."""

import nengo
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import spikeport
from spikeport.compile.ground.identity import identity
from spikeport.digest import digest_of


def digest(network):
    return digest_of(identity(network))


def plain():
    """Return a network that a compile builds as it is, and not a copy of it."""
    with nengo.Network(seed=1) as net:
        ensemble = nengo.Ensemble(10, 1)
        nengo.Connection(nengo.Node([0.5]), ensemble)
        with nengo.Network():
            nengo.Connection(ensemble, nengo.Ensemble(5, 1))
    return net


def made(
    change=lambda _: None,
    weights=((1.0, 2.0),),
    power=2,
    order="C",
    called=np.sin,
    configurable=True,
):
    """Return a network, after a call of ``change`` with it."""
    with nengo.Network(seed=1, label="net") as net:
        if configurable:
            spikeport.add_params(net)
        net.node = nengo.Node(lambda t: called(t))
        net.a = nengo.Ensemble(20, 2, label="a")
        with nengo.Network(label="inner") as net.inner:
            net.b = nengo.Ensemble(10, 1, seed=3)
        nengo.Connection(net.node, net.a[0])
        net.on_host = nengo.Connection(net.node, net.a[1], function=lambda x: called(x))
        net.wired = nengo.Connection(net.a, net.b, transform=np.array(weights, order=order))
        net.squared = nengo.Connection(net.a, net.b, function=lambda x: x[0] ** power)
        net.wired_neurons = nengo.Connection(net.a.neurons[:5], net.b.neurons[5:], transform=0.01)
        net.probe = nengo.Probe(net.b, synapse=0.01)
        change(net)
    return net


def test_equal_networks_have_the_same_identity():
    assert digest(made()) == digest(made())
    assert digest(made(called=np.cos)) == digest(made())


def test_objects_that_share_a_function_change_the_identity():
    """A cached compile refers to functions by object, so it must know which objects share one."""

    def calling(first, second, third):
        def change(net):
            nengo.Node(first)
            nengo.Connection(nengo.Node(second), net.a[0], function=third)

        return digest(made(change))

    f, g, h = lambda t: t, lambda t: -t, lambda t: 2 * t
    shared = [(f, g, h), (f, f, h), (f, g, f), (f, g, g), (f, f, f)]
    assert len({calling(*each) for each in shared}) == len(shared)
    assert calling(f, g, h) == calling(h, f, g)
    assert calling(f, f, g) == calling(g, g, h)
    assert calling(np.sin, np.sin, f) != calling(f, f, g)  # its values are known (SP421)


def test_the_entries_and_order_of_a_slice_change_the_identity():
    def sliced(part):
        return digest(made(lambda net: nengo.Connection(net.a[part], net.b.neurons[:2])))

    parts = [[1, 0], [0, 1], slice(None), slice(None, None, -1)]
    assert len({sliced(part) for part in parts}) == len(parts)


@pytest.mark.parametrize("make", [made, plain])
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_a_compile_leaves_the_identity_of_a_network_unchanged(pipeline, make):
    network = make()
    before = digest(network)
    spikeport.compile_network(network, pipeline=pipeline)
    assert digest(network) == before


def test_a_users_default_for_a_setting_of_the_compiler_changes_the_identity():
    def off_chip(net):
        net.config[nengo.Ensemble].on_chip = False

    def with_a_default(net):
        default = nengo.params.BoolParam("on_chip", default=False)
        net.config[nengo.Ensemble].set_param("on_chip", default)

    usual = digest(made())
    assert usual == digest(made(configurable=False))
    assert digest(made(off_chip)) != usual
    assert digest(made(with_a_default, configurable=False)) != usual


def setting(path, value):
    """Return a change that sets an attribute, given by its dotted path, to a value."""
    *parts, name = path.split(".")

    def change(net):
        for part in parts:
            net = getattr(net, part)
        setattr(net, name, value)

    return change


def configured(net):
    net.config[net.b].on_chip = False


def of_class(net):
    net.config[nengo.Connection].set_param("mine", nengo.params.Parameter("mine", default=1))


CHANGES = [
    setting("seed", 2),
    setting("label", "other"),
    setting("inner.seed", 2),
    setting("a.radius", 1.1),
    setting("a.label", "c"),
    setting("a.seed", 5),
    setting("a.encoders", nengo.dists.Choice([[1, 0]])),
    setting("a.max_rates", nengo.dists.Uniform(100, 201)),
    setting("a.neuron_type", nengo.SpikingRectifiedLinear()),
    setting("a.neuron_type", nengo.LIF(tau_rc=0.021)),
    setting("a.eval_points", np.zeros((5, 2))),
    setting("wired.synapse", 0.006),
    setting("wired.synapse", nengo.Alpha(0.005)),
    setting("squared.solver", nengo.solvers.LstsqL2(reg=0.2)),
    setting("squared.solver", nengo.solvers.LstsqL2(weights=True)),
    setting("squared.scale_eval_points", False),
    setting("probe.synapse", 0.011),
    setting("node.output", np.tanh),
    setting("probe.sample_every", 0.01),
    setting("node.label", "node"),
    configured,
    of_class,
    lambda net: nengo.Connection(net.a[0], net.b),
    lambda net: nengo.Probe(net.a.neurons[:3]),
    lambda net: nengo.Ensemble(5, 1),
]


@pytest.mark.parametrize("change", CHANGES)
def test_any_change_of_a_network_changes_its_identity(change):
    assert digest(made(change)) != digest(made())


def test_different_changes_give_different_identities():
    assert len({digest(made(change)) for change in CHANGES}) == len(CHANGES)


def test_values_that_functions_close_over_change_the_identity():
    assert digest(made(power=3)) != digest(made())


@settings(max_examples=20)
@given(arrays(float, (1, 2), elements=st.floats(-1e3, 1e3)), st.integers(0, 1))
def test_the_last_bit_of_a_weight_changes_the_identity(weights, at):
    changed = weights.copy()
    changed[0, at] = np.nextafter(changed[0, at], np.inf)
    assert digest(made(weights=weights)) != digest(made(weights=changed))


class Scaled(np.ndarray):
    """An array of a user's class, which may multiply in its own way."""


class Halved(np.float64):
    """A number of a user's class, which may multiply in its own way."""


def reaching(value):
    """Return the digest of a network with a function that reaches a value."""

    def change(net):
        nengo.Connection(net.a, net.b, function=lambda x: [x[0], value][0])

    return digest(made(change))


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_class_and_field_names_of_an_array_count_and_unknown_classes_are_refused():
    weights = np.ones(2)
    one, other = (np.zeros(2, [(a, float), (b, float)]) for a, b in ("ab", "ba"))
    arrays = [weights, weights.view(np.matrix), one, other, one.view(np.recarray), one[0]]
    assert len({reaching(each) for each in arrays}) == len(arrays)
    assert reaching(one.dtype) != reaching(other.dtype)
    for refused in (weights.view(Scaled), Halved(1.0), np.ma.masked_array(weights, [0, 1])):
        with pytest.raises(TypeError, match="has no identity that lasts"):
            reaching(refused)


def test_the_error_names_the_part_of_a_network_without_identity():
    class Mine:
        factor = 2

    mine = Mine()

    def change(net):
        nengo.Connection(net.a, net.b, function=lambda x: mine.factor * x[0])

    with pytest.raises(TypeError, match=r"<Connection .*an object of .*Mine has no identity"):
        digest(made(change))


class Subnet(nengo.Network):
    """A user's network, whose functions read its own attribute."""

    gain = 2

    def scaled(self, x):
        return self.gain * x[0]


def uses_attribute_of_network(net):
    net.gain = 2
    return lambda x: net.gain * x[0]


def uses_attribute_of_subnetwork(net):
    with net:
        return Subnet().scaled


def uses_function_of_node(net):
    return lambda x: net.node.output(0.0) * x[0]


def uses_function_of_connection(net):
    connections = [net.on_host]
    return lambda x: connections[0].function(x)[0]


def uses_parts_of_an_ensemble(net):
    parts = {"neurons": net.a.neurons, "first": net.a[0]}
    return lambda x: parts["first"].size_out * x[0]


@pytest.mark.parametrize(
    "make",
    [
        uses_attribute_of_network,
        uses_attribute_of_subnetwork,
        uses_function_of_node,
        uses_function_of_connection,
        uses_parts_of_an_ensemble,
    ],
)
def test_functions_that_use_objects_of_their_network_have_no_identity(make):
    def change(net):
        nengo.Connection(net.a, net.b, function=make(net))

    with pytest.raises(TypeError, match=r"<Connection .*uses a network's object has no ident"):
        digest(made(change))
