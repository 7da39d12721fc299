"""Ports in closed loop with a plant that only counts."""

import nengo
import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.experiments.loop import Loop, Port, Recording


class Counter:
    """A plant whose state is the sum of what it was pushed by."""

    dt_s = 0.004

    def __init__(self):
        self.time_s = 0.0
        self.place, self.push = 0.0, 0.0

    def step(self):
        self.place += self.push
        self.time_s += self.dt_s


class Pusher(Port):
    """Two values in, one out; it notes what it is asked, in a list that ports share."""

    size_in, size_out = 2, 1

    def __init__(self, name, plant, journal):
        self.name, self.plant, self.journal = name, plant, journal
        self.driven = []

    def begin(self):
        self.driven = []

    def observe(self):
        self.journal.append(f"{self.name} observes")
        return np.array([self.plant.place])

    def drive(self, values):
        self.journal.append(f"{self.name} drives")
        self.driven.append(values.tolist())
        self.plant.push = values[0]


class Switch(Pusher):
    size_in, size_out = 1, 3

    def observe(self):
        super().observe()
        return np.array([7.0, 8.0, 9.0])

    @property
    def over(self):
        return self.plant.place > 10


@pytest.fixture
def made():
    plant, journal = Counter(), []
    ports = [Pusher("left", plant, journal), Pusher("right", plant, journal)]
    gate = Switch("gate", plant, journal)
    loop = Loop(plant, ports, dt_s=0.002, gate=gate)
    loop.begin()
    return loop, ports, gate, journal


def test_values_lie_in_the_order_of_the_ports_and_the_gates_last(made):
    loop, (left, right), gate, _ = made
    values = np.arange(5.0)
    assert loop.step(values).tolist() == [0, 0, 7, 8, 9]
    assert loop.step(values).tolist() == [2, 2, 7, 8, 9]
    assert (left.driven, right.driven, gate.driven) == ([[0, 1]], [[2, 3]], [[4]])
    assert (loop.size_in, loop.size_out) == (5, 5)


def test_the_gate_is_served_before_the_ports(made):
    loop, _, _, journal = made
    in_turn = ["gate", "left", "right"]
    assert journal == [f"{name} observes" for name in in_turn]
    journal.clear()
    loop.step(np.zeros(5))
    assert journal == []
    loop.step(np.zeros(5))
    assert journal == [f"{name} {does}" for does in ("drives", "observes") for name in in_turn]


def test_what_is_driven_is_the_value_at_the_plants_step_and_no_later_one(made):
    loop, (left, _), _, _ = made
    values = np.zeros(5)
    for values[0] in range(4):
        loop.step(values)
    assert left.driven == [[1, 0], [3, 0]]


def test_a_loop_is_over_when_a_port_is_and_begins_anew(made):
    loop, (left, _), _, _ = made
    for _ in range(2):
        assert not loop.over
        loop.step(np.full(5, 11.0))
    assert loop.over
    loop.plant.place = 0.0
    loop.begin()
    assert not loop.over
    assert left.driven == []


def test_a_controller_takes_and_returns_the_values_of_its_nodes(made):
    loop, (left, right), gate, _ = made
    with nengo.Network() as network:
        here, there = nengo.Node(size_in=2), nengo.Node(size_in=3)
        both, last = nengo.Node([1, 2, 3, 4]), nengo.Node([5])
        loop.connect([here, there], [both, last])
        probes = [nengo.Probe(node) for node in (here, there)]
    with nengo.Simulator(network, dt=0.002, progress_bar=False) as sim:
        sim.run_steps(4)
    assert (left.driven[-1], right.driven[-1], gate.driven[-1]) == ([1, 2], [3, 4], [5])
    assert sim.data[probes[0]][-1].tolist() == [6, 6]
    assert sim.data[probes[1]][-1].tolist() == [7, 8, 9]


def refusal(function, *arguments):
    with pytest.raises(UsageError) as caught:
        function(*arguments)
    return str(caught.value)


def test_nodes_of_another_size_are_refused(made):
    loop, *_ = made
    with nengo.Network():
        node = nengo.Node(size_in=3, label="speed")
        assert refusal(loop.connect, [node], []) == (
            "the controller's inputs take 3 values (<Node 'speed'>), those of the ports are 5; "
            "cure: name a node for each value, in the order of the ports"
        )
        five = nengo.Node(size_in=5)
        assert refusal(loop.connect, [five], [node]).startswith("the controller's outputs are 3 ")


def test_a_port_that_observes_more_than_it_says_is_refused():
    class Wide(Pusher):
        size_out = 4

    loop = Loop(Counter(), [Wide("wide", Counter(), [])])
    assert refusal(loop.begin) == (
        "the ports observe 1 values, their size_out sum up to 4; cure: make size_out the length "
        "of what observe() returns"
    )


@pytest.mark.parametrize("dt_s", [0.003, 0.01])
def test_time_steps_that_do_not_fit_are_refused(dt_s):
    assert refusal(Loop, Counter(), [], dt_s) == (
        f"the plant steps every 4 ms, which is no multiple of the controller's {1000 * dt_s:g} ms; "
        "cure: another time step of either"
    )


def test_recordings_are_columns_that_can_be_chosen_from_and_joined():
    recording = Recording.of([(0.0,), (0.1,), (0.2,)])
    assert recording.time_s.tolist() == [0.0, 0.1, 0.2]
    late = recording.where(recording.time_s > 0.05)
    assert late.time_s.tolist() == [0.1, 0.2]
    assert Recording.join([late, recording]).time_s.tolist() == [0.1, 0.2, 0.0, 0.1, 0.2]
