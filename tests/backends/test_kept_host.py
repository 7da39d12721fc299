"""The host of a kept compilation, which calls the functions of the network at hand."""

import nengo
import numpy as np
import pytest

from spikeport import compile_network
from spikeport.backends.host_program import host_program
from spikeport.backends.kept_host import Edge, HostReader, HostWriter, UsersObjects
from spikeport.backends.kept_values import NotKeptError, Reader


def made():
    with nengo.Network(seed=0) as network:
        source, ensemble = nengo.Node(np.sin), nengo.Ensemble(10, 1)
        nengo.Connection(source, ensemble)
        nengo.Connection(ensemble, nengo.Node(lambda t, x: None, size_in=1))
        nengo.Probe(source)
    return network


def test_a_kept_host_calls_the_functions_of_the_network_it_is_read_for():
    network, other = made(), made()
    program, users = host_program(compile_network(network)), UsersObjects(network)
    writer = HostWriter(users, program)
    reader = Reader(writer.values.arrays(writer.program({})))
    found = HostReader(reader, reader.tree, UsersObjects(other)).program()
    kinds, wanted = ([type(op) for op in one.model.operators] for one in (found, program))
    assert kinds == wanted
    assert [port[1:] for port in found.senders] == [port[1:] for port in program.senders]
    assert found.model.probes == other.all_probes
    called = {id(op.fn) for op in found.model.operators if hasattr(op, "fn")}
    assert called == {id(node.output) for node in other.all_nodes}


def test_a_host_with_functions_from_outside_the_network_is_not_kept():
    network = made()
    program = host_program(compile_network(network))
    with nengo.Network() as empty, pytest.raises(NotKeptError):
        HostWriter(UsersObjects(empty), program).program({})


def test_an_edge_returns_nothing_or_zeros():
    assert Edge().make_step((2,), (0,), 0.001, None, {})(0.0, np.ones(2)) is None
    np.testing.assert_array_equal(Edge().make_step((0,), (3,), 0.001, None, {})(0.0), np.zeros(3))
