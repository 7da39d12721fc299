"""The host's side of a network that nengo-loihi has built."""

import nengo

from spikeport.backends.host_program import HostProgram, host_program
from spikeport.compile.pipeline import compile_network


def program_of(network: nengo.Network) -> HostProgram:
    return host_program(compile_network(network))


def test_inputs_and_outputs_are_numbered_as_in_the_model() -> None:
    with nengo.Network(seed=1) as network:
        for size in (1, 3):
            a = nengo.Ensemble(10, size)
            nengo.Connection(nengo.Node([0.5] * size), a)
        voltage = nengo.Probe(a.neurons, "voltage")
        end = nengo.Node(lambda _t, x: x, size_in=3)
        nengo.Connection(a, end)
        nengo.Probe(end)
    program = program_of(network)
    # an on/off pair for each dimension
    assert [(port.size, port.target) for port in program.senders] == [(2, 0), (6, 1)]
    assert program.error_senders == ()
    assert list(program.probes) == [voltage]
    numbers = [program.probes[voltage], *(number for number, _ in program.receivers)]
    assert sorted(numbers) == [0, 1]


def test_learning_errors_go_to_groups_numbered_among_themselves() -> None:
    with nengo.Network(seed=1) as network:
        stimulus, a = nengo.Node([0.5]), nengo.Ensemble(10, 1)
        nengo.Connection(stimulus, a)
        for size in (1, 2):
            out = nengo.Node(size_in=size)
            rule = nengo.PES(1e-3)
            function = [lambda _x: 0, lambda _x: [0, 0]][size - 1]
            learned = nengo.Connection(a, out, function=function, learning_rule_type=rule)
            nengo.Connection(out, learned.learning_rule)
    program = program_of(network)
    assert [(port.size, port.target) for port in program.error_senders] == [(1, 0), (2, 1)]
