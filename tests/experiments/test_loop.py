"""Ports in closed loop with a plant that only counts."""

import dataclasses

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.errors import DivergedError, UsageError
from spikeport.experiments.loop import Loop, Port


class Counter:
    """A plant whose state is the sum of its pushes."""

    dt_s = 0.004

    def __init__(self):
        self.time_s = 0.0
        self.place, self.push = 0.0, 0.0

    def step(self):
        self.place += self.push
        self.time_s += self.dt_s


class Pusher(Port):
    """A port with two values in and one out, which logs its calls in a list that ports share."""

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


def test_values_follow_the_order_of_the_ports_and_the_gates_values_come_last(made):
    loop, (left, right), gate, _ = made
    values = np.arange(5.0)
    assert loop.step(values).tolist() == [0, 0, 7, 8, 9]
    assert loop.step(values).tolist() == [2, 2, 7, 8, 9]
    assert (left.driven, right.driven, gate.driven) == ([[0, 1]], [[2, 3]], [[4]])
    assert (loop.size_in, loop.size_out) == (5, 5)


def test_an_observation_that_the_caller_changes_is_not_the_one_that_is_held(made):
    loop, *_ = made
    values = np.zeros(5)
    for _ in range(3):
        found = loop.step(values)
        assert found[2:].tolist() == [7, 8, 9]
        found /= 2


def test_the_gate_is_served_before_the_ports(made):
    loop, _, _, journal = made
    in_turn = ["gate", "left", "right"]
    assert journal == [f"{name} observes" for name in in_turn]
    journal.clear()
    loop.step(np.zeros(5))
    assert journal == []
    loop.step(np.zeros(5))
    assert journal == [f"{name} {does}" for does in ("drives", "observes") for name in in_turn]


def test_ports_drive_the_plant_with_the_values_of_the_step_in_which_it_moves(made):
    loop, (left, _), _, _ = made
    values = np.zeros(5)
    for values[0] in range(4):
        loop.step(values)
    assert left.driven == [[1, 0], [3, 0]]


def test_a_loop_is_over_once_a_port_is_over_and_can_begin_again(made):
    loop, (left, _), _, _ = made
    for _ in range(2):
        assert not loop.over
        loop.step(np.full(5, 11.0))
    assert loop.over
    loop.plant.place = 0.0
    loop.begin()
    assert not loop.over
    assert left.driven == []


def test_connected_nodes_receive_the_observations_and_send_the_values_of_the_ports(made):
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


def test_nodes_of_another_total_size_than_the_ports_are_refused(made):
    loop, *_ = made
    with nengo.Network():
        node = nengo.Node(size_in=3, label="speed")
        assert refusal(loop.connect, [node], []) == (
            "the controller's inputs take 3 values (<Node 'speed'>), but the ports have 5; "
            "cure: pass nodes with as many values as the ports, in their order"
        )
        five = nengo.Node(size_in=5)
        assert refusal(loop.connect, [five], [node]).startswith("the controller's outputs are 3 ")


def test_a_whole_network_in_place_of_its_nodes_is_refused(made):
    loop, *_ = made
    with nengo.Network():
        network = nengo.Network(label="balancer")
        message = refusal(loop.connect, [network], [])
    assert message.startswith('Loop.connect(): <Network "balancer"> is no node; cure: name the')


def test_a_port_that_observes_fewer_values_than_its_size_out_is_refused():
    class Wide(Pusher):
        size_out = 4

    loop = Loop(Counter(), [Wide("wide", Counter(), [])])
    assert refusal(loop.begin) == (
        "Wide.observe() returned an array of shape (1,) at 0 s, expected an array of shape (4,), "
        "as its size_out says; cure: return a flat array of that many numbers, or change size_out"
    )


class Sensor(Pusher):
    """A port that commands nothing, and observes the time."""

    size_in, size_out = 0, 1

    def observe(self):
        return np.array([self.plant.time_s])

    def drive(self, values):
        assert values.shape == (0,)


class Odd(Pusher):
    """A port that observes two ones, and ``found`` from the plant's second step on."""

    size_out, found = 2, None

    def observe(self):
        return np.ones(2) if self.plant.time_s < 0.006 else self.found


@pytest.fixture
def odd():
    plant = Counter()
    loop = Loop(plant, [Odd("odd", plant, []), Pusher("other", plant, [])], dt_s=0.004)
    loop.begin()
    loop.step(np.zeros(4))
    return loop


@pytest.mark.parametrize("backend", ["native", "reference"])
def test_the_error_of_a_simulator_names_the_port_that_observes_nan(odd, monkeypatch, backend):
    monkeypatch.setattr(Odd, "found", np.full(2, np.nan))
    with Simulator(connected(odd), backend=backend, dt=0.004) as sim:
        odd.plant.time_s = 0.0
        odd.begin()
        with pytest.raises(DivergedError, match=r"^Odd\.observe\(\) returned nan as value 0 of"):
            sim.run_steps(4)


def connected(loop):
    """Return a network with neurons that is connected with a loop."""
    with nengo.Network(seed=0) as network:
        inputs, outputs = nengo.Node(size_in=loop.size_out), nengo.Node(size_in=loop.size_in)
        at_rest = nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])})
        neurons = nengo.Ensemble(10, 1, neuron_type=at_rest)
        nengo.Connection(inputs[0], neurons)
        nengo.Connection(neurons, outputs[0])
        loop.connect([inputs], [outputs])
    return network


def counting(dt_s, plant_s=0.004):
    """Return a loop around a `Counter` with steps of ``plant_s``."""
    plant = Counter()
    plant.dt_s = plant_s
    return Loop(plant, [Pusher("one", plant, [])], dt_s)


BACKENDS = pytest.mark.parametrize("backend", ["native", "reference"])


@BACKENDS
@pytest.mark.parametrize("plant_s", [0.001, 0.004])
def test_a_simulator_with_another_time_step_is_refused_before_a_second_step(backend, plant_s):
    loop = counting(0.001, plant_s)
    with Simulator(connected(loop), backend=backend, dt=0.002) as sim:
        loop.begin()
        with pytest.raises(UsageError) as caught:
            sim.run_steps(10)
    assert loop.plant.time_s <= 0.001
    assert str(caught.value) == (
        "the loop is made for time steps of 1 ms, the simulator's are 2 ms, so the plant would run "
        "at another speed; cure: Loop(..., dt_s=0.002), or a simulator with dt=0.001"
    )


@BACKENDS
@pytest.mark.parametrize(("dt_s", "plant_s"), [(0.001, 0.004), (0.002, 0.004), (0.002, 0.002)])
def test_a_run_can_begin_at_any_time_of_a_simulator_and_after_its_reset(backend, dt_s, plant_s):
    loop = counting(dt_s, plant_s)
    with Simulator(connected(loop), backend=backend, dt=dt_s) as sim:
        for steps in (1, 8, 25, 40):
            loop.plant.time_s = 0.0
            loop.begin()
            sim.run_steps(steps)
            assert loop.plant.time_s == pytest.approx(steps * dt_s // plant_s * plant_s)
        sim.reset()
        loop.plant.time_s = 0.0
        loop.begin()
        sim.run_steps(40)
        assert loop.plant.time_s == pytest.approx(sim.time)


@BACKENDS
def test_a_simulator_time_that_goes_back_within_a_run_is_refused(backend):
    """A second simulator would step the plant twice as often."""
    loop = counting(0.001)
    network = connected(loop)
    words = "went from 0.008 s to 0.001 s within a run: it was reset, or another simulator steps"
    with Simulator(network, backend=backend) as sim, Simulator(network, backend=backend) as other:
        loop.begin()
        sim.run_steps(8)
        assert words in refusal(other.run_steps, 8)
        loop.begin()
        sim.run_steps(8)
        sim.reset()
        assert "within a run: it was reset" in refusal(sim.run_steps, 8)


def test_a_port_without_commands_is_observed():
    loop = Loop(plant := Counter(), [Sensor("sensor", plant, [])], 0.004)
    with nengo.Network() as network:
        inputs = nengo.Node(size_in=1)
        loop.connect([inputs], [])
        probe = nengo.Probe(inputs)
    with Simulator(network, backend="reference", dt=0.004) as sim:
        loop.begin()
        sim.run_steps(3)
    assert sim.data[probe].ravel().tolist() == pytest.approx([0.004, 0.008, 0.012])


def test_plant_steps_that_are_no_multiple_of_the_controllers_are_refused():
    assert refusal(Loop, Counter(), [], 0.003).startswith("the plant steps every 4 ms, which is no")


def unlike(**members):
    """Return a port whose members are replaced."""
    port = Pusher("odd", Counter(), [])
    for name, value in members.items():
        setattr(port, name, value)
    return port


@pytest.mark.parametrize(
    ("ports", "message"),
    [
        ([], "no port, at least 1; cure: Loop(plant, [port])"),
        (unlike(), "ports is one Pusher, expected a sequence of ports; cure: Loop(plant, [port])"),
        ({"arm": unlike()}, "ports is one dict, expected a sequence of ports; cure: Loop(plant"),
        ([3.5], "3.5 is no port; cure: an object of a subclass of spikeport.experiments.loop.Port"),
        ([Pusher], "is no port; cure: an object of a subclass of spikeport.experiments.loop.Port"),
        ([unlike()] * 2, "a Pusher is listed twice; cure: an object for each place"),
        (
            [unlike(size_in=None)],
            "Pusher.size_in is None, limit whole numbers from 0 on; cure: the number of values "
            "that drive() takes",
        ),
        (
            [unlike(size_out=1.0)],
            "Pusher.size_out is 1.0, limit whole numbers from 0 on; cure: the number of values "
            "that observe() returns",
        ),
        (
            [unlike(size_in=-1)],
            "Pusher.size_in is -1, limit whole numbers from 0 on; cure: the number of values "
            "that drive() takes",
        ),
    ],
)
def test_ports_that_cannot_be_served_are_refused(ports, message):
    assert message in refusal(Loop, Counter(), ports)


def test_a_plant_without_time_or_steps_is_refused():
    message = refusal(Loop, object(), [unlike()])
    assert "object has no dt_s and no time_s and no step; cure: a plant as" in message


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("dt_s", "a number, in s"),
        ("time_s", "a number, in s"),
        ("has_own_clock", "True or False"),  # a method counts as true: no step would be checked
    ],
)
def test_a_plant_with_a_method_in_place_of_a_value_is_refused(name, expected):
    plant = type("Timed", (), {"dt_s": 0.001, "time_s": 0.0, "step": None} | {name: lambda _: 1.0})
    assert refusal(Loop, plant(), [unlike()]) == (
        f"Loop(plant, ports): Timed.{name} is a method, expected {expected}; "
        "cure: write @property above it"
    )


def test_a_port_that_is_over_by_a_method_is_refused():
    """A method counts as true: each run would end before its first step."""

    class Falling(Pusher):
        def over(self):
            return False

    assert refusal(Loop, Counter(), [Falling("one", Counter(), [])]) == (
        "Loop(plant, ports): Falling.over is a method, expected True or False; "
        "cure: write @property above it"
    )


@pytest.mark.parametrize(
    ("values", "named"),
    [
        (np.zeros(3), "an array of shape (3,)"),
        (np.zeros(5), "an array of shape (5,)"),
        (np.zeros((1, 4)), "an array of shape (1, 4)"),
        (0.5, "an array of shape ()"),
        (np.array([1j, 0, 0, 0]), "an array of complex128, [0.+1.j 0.+0.j 0.+0.j 0.+0.j],"),
        (None, "None"),
    ],
)
def test_values_of_another_shape_than_that_of_all_ports_are_refused(odd, values, named):
    assert refusal(odd.step, values) == (
        f"Loop.step() got {named} where an array of shape (4,) is expected, the sum of all size_in;"
        " cure: pass the values of all ports, one after the other"
    )


def test_values_may_be_a_list():
    loop = Loop(plant := Counter(), [port := Pusher("one", plant, [])], 0.004)
    loop.begin()
    loop.step([1, 2])
    assert port.driven == [[1.0, 2.0]]


def test_ports_may_come_from_a_generator():
    loop = Loop(plant := Counter(), (Pusher(name, plant, []) for name in "ab"), 0.004)
    loop.begin()
    assert loop.step(np.zeros(4)).tolist() == [0, 0]


@dataclasses.dataclass
class Equal(Port):
    """A port that is equal to every other one, and has no hash."""

    size_in, size_out = 1, 1
    driven: list = dataclasses.field(default_factory=list, compare=False)

    def observe(self):
        return np.zeros(1)

    def drive(self, values):
        self.driven.append(values.item())


def test_ports_that_are_equal_get_their_own_values():
    ports = [Equal(), Equal()]
    loop = Loop(Counter(), ports, 0.004)
    loop.begin()
    loop.step(np.array([1.0, 2.0]))
    assert [port.driven for port in ports] == [[1.0], [2.0]]


def test_a_port_may_reset_the_plant_when_a_run_begins():
    class Resetting(Pusher):
        def begin(self):
            self.plant.time_s = 0.0

    loop = Loop(plant := Counter(), [Resetting("one", plant, [])], 0.004)
    for _ in range(2):
        loop.begin()
        for _ in range(3):
            loop.step(np.zeros(2))
    assert plant.time_s == pytest.approx(0.012)


def test_a_plant_whose_time_goes_back_within_a_run_has_diverged():
    loop = counting(0.004)
    loop.begin()
    for _ in range(3):
        loop.step(np.zeros(2))
    loop.plant.time_s = 0.0
    with pytest.raises(DivergedError, match=r"went from 0\.012 s to 0\.004 s within a run: it was"):
        loop.step(np.zeros(2))
    loop.begin()
    loop.step(np.zeros(2))


@pytest.mark.parametrize("time_s", [[0.0, 0.0, 0.02], [0.02, 0.02, 0.06]])
def test_a_robot_at_the_end_of_a_link_may_be_held_or_miss_steps(time_s):
    plant, times = Counter(), iter(time_s)
    plant.has_own_clock = False
    plant.step = lambda: setattr(plant, "time_s", next(times))
    loop = Loop(plant, [port := Pusher("one", plant, [])], 0.004)
    plant.has_own_clock = True  # connected when a run begins, as a `LinkedPlant`
    loop.begin()
    for _ in time_s:
        loop.step(np.zeros(2))
    assert (len(port.driven), plant.time_s) == (3, time_s[-1])
    plant.step = lambda: setattr(plant, "time_s", 0.0)
    with pytest.raises(DivergedError):
        loop.step(np.zeros(2))


def test_a_second_controller_is_refused(made):
    loop, *_ = made
    with nengo.Network():
        inputs, outputs = nengo.Node(size_in=5), nengo.Node(size_in=5)
        loop.connect([inputs], [outputs])
        assert refusal(loop.connect, [inputs], [outputs]) == (
            "the loop is connected already, and a second controller would step its plant, too; "
            "cure: name all inputs and outputs in one connect(), or make another Loop"
        )


@pytest.mark.parametrize("backend", ["native", "reference"])
def test_a_step_before_begin_is_refused(backend):
    loop = counting(0.001)
    message = refusal(loop.step, np.zeros(2))
    assert message.startswith("the loop has begun no run, so ")
    assert message.endswith(
        "cure: call begin() when the plant is where the run starts, before the first step"
    )
    with Simulator(connected(loop), backend=backend) as sim:
        broken_off = (
            "reset() the simulator, whose step was broken off; code that makes a network for "
            "a command calls begin() itself"
        )
        assert refusal(sim.step) == f"{message}, and {broken_off}"
        loop.begin()
        sim.reset()
        sim.run_steps(8)
        assert loop.plant.time_s == pytest.approx(sim.time)
    loop = counting(0.001)
    loop.begin()
    assert loop.step(np.zeros(2)).tolist() == [0]
