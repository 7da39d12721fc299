"""Names of probes, and probes of outputs for a network that has none."""

import itertools

import nengo
import numpy as np
import pytest

from spikeport import compile_network
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.errors import UsageError
from spikeport.simulation.probes import (
    outputs,
    probe_outputs,
    probes_by_name,
    probing_outputs,
    records_spikes,
)


@pytest.fixture
def network():
    with nengo.Network(seed=1) as net:
        stimulus = nengo.Node([0.5, 0], label="stimulus")
        net.a = nengo.Ensemble(10, 2, label="a")
        net.b = nengo.Ensemble(10, 1, label="b")
        net.out = nengo.Node(size_in=1, label="out")
        nengo.Connection(stimulus, net.a)
        nengo.Connection(net.a[0], net.b)
        nengo.Connection(net.b, net.b, synapse=0.1)
        nengo.Connection(net.a[1], net.out)
    return net


def test_probes_are_named_by_their_label_or_by_the_object_they_record(network):
    with network:
        probes = [
            nengo.Probe(network.a, label="named"),
            nengo.Probe(network.a),
            nengo.Probe(network.a, synapse=0.01),
            nengo.Probe(network.a[[1, 0]]),
            nengo.Probe(network.a[1:]),
            nengo.Probe(network.a.neurons),
            nengo.Probe(network.a.neurons, "voltage"),
            nengo.Probe(network.out),
        ]
    names = ["named", "a", "a#2", "a[1, 0]", "a[1:]", "a spikes", "a voltage", "out"]
    assert probes_by_name(network) == dict(zip(names, probes, strict=True))
    assert [records_spikes(probe) for probe in probes] == [name == "a spikes" for name in names]


def test_a_probe_keeps_its_label_even_if_other_objects_have_it(network):
    with network:
        nengo.Ensemble(5, 1, label="taken")
        probes = [nengo.Probe(network.a, label=label) for label in ("taken", "taken", "other#2")]
        with nengo.Network(label="sub"):
            nengo.Ensemble(5, 1, label="taken")
            probes.append(nengo.Probe(network.a, label="taken"))
    assert probes_by_name(network) == dict(
        zip(["taken", "taken#2", "other#2", "sub.taken"], probes, strict=True)
    )


def test_outputs_are_the_objects_that_nothing_else_reads(network):
    assert list(outputs(network)) == [network.b, network.out]


def test_adding_probes_of_outputs_keeps_the_biases_of_neurons(network):
    before = compile_network(network)
    added = probe_outputs(network)
    assert network.all_probes == added
    assert [probe.synapse is not None for probe in added] == [True, False]
    after = compile_network(network)
    assert set(before.image.compartments.bias) <= set(after.image.compartments.bias)


def test_every_ensemble_is_probed_if_something_reads_every_object():
    with nengo.Network() as net:
        a, b = nengo.Ensemble(5, 1), nengo.Ensemble(5, 1)
        nengo.Connection(a, b)
        nengo.Connection(b, a)
    assert [probe.obj for probe in probe_outputs(net)] == [a, b]


def test_a_network_with_nothing_to_probe_is_refused():
    with nengo.Network() as net:
        nengo.Node([0.5])
    with pytest.raises(UsageError, match=r"^the network has no probe, and neither outputs nor "):
        probe_outputs(net)
    assert net.all_probes == []


def test_spikes_are_probed_if_no_value_can_be_decoded(network, capsys):
    """One output has neurons that fire at no evaluation point; another can be decoded."""
    with network:
        silent = nengo.Ensemble(5, 1, gain=np.full(5, 0.1), bias=np.zeros(5), label="silent")
        nengo.Connection(network.out, silent.neurons, transform=np.full((5, 1), 20))
    compilation = probing_outputs(network, lambda: compile_network(network))
    assert {probe.obj for probe in network.all_probes} == {network.b, silent.neurons}
    assert len(compilation.image.manifest.outputs) == 2
    notes = capsys.readouterr().err.splitlines()
    assert [note.rpartition(": ")[2] for note in notes] == ["b, silent", "b, silent spikes"]


def test_other_refusals_are_raised(network):
    network.b.noise = nengo.processes.WhiteNoise()
    with pytest.raises(DoesNotFitError, match="SP003"):
        probing_outputs(network, lambda: compile_network(network))


def test_an_output_behind_a_node_that_nengo_loihi_removes_is_probed(network, capsys):
    with network:
        middle, end = (nengo.Node(size_in=1, label=label) for label in ("middle", "end"))
        nengo.Connection(network.b, middle)
        nengo.Connection(middle, end, synapse=None)
        nengo.Connection(middle, network.b)
    probing_outputs(network, lambda: compile_network(network))
    assert capsys.readouterr().err.count("note: ") == 1
    assert end in {probe.obj for probe in network.all_probes}


@pytest.mark.parametrize("labels", sorted(set(itertools.permutations(["x", "x", "x#2", "x#2"]))))
def test_no_probe_gets_the_label_of_another(network, labels):
    with network:
        probes = [nengo.Probe(network.a, label=label) for label in labels]
    found = probes_by_name(network)
    assert list(found.values()) == probes
    for label in ("x", "x#2"):
        assert found[label] is probes[labels.index(label)]
