"""The example of docs/own-robot.md: a cart-pole on the emulated chip."""

import importlib.util
import re
import shutil
from pathlib import Path

import nengo
import numpy as np
import pytest
import torch

from spikeport import Simulator, compile_network
from spikeport.experiments.loop import Loop, Port
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.perceptron import perceptron
from spikeport.networks.policy import Layer, PolicyOptions
from spikeport.simulation.run import SimulationOptions, run

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "own_robot.py"


@pytest.fixture(scope="module")
def own_robot():
    spec = importlib.util.spec_from_file_location("own_robot", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def balanced(own_robot):
    return own_robot.balance(10.0)


def test_the_pole_falls_without_a_controller(own_robot):
    tilts_rad = own_robot.fall(4.0)
    assert abs(tilts_rad[-1]) > np.pi / 2
    assert len(tilts_rad) < 0.3 * 4.0 / own_robot.CartPole().dt_s


@pytest.mark.slow
def test_neurons_on_the_chip_balance_the_pole(own_robot, balanced):
    assert len(balanced) == 1 + round(10.0 / own_robot.CartPole().dt_s)
    assert np.abs(balanced).max() < 1.1 * own_robot.TILT_RAD
    assert np.abs(balanced[-200:]).max() < 0.5 * own_robot.TILT_RAD


def test_the_page_shows_the_lines_that_the_example_prints(own_robot, balanced, monkeypatch, capsys):
    monkeypatch.setattr(own_robot, "balance", lambda _: balanced)
    own_robot.main()
    printed = capsys.readouterr().out.splitlines()
    late = np.degrees(np.abs(balanced[-round(1 / own_robot.CartPole().dt_s) :]).max())
    assert printed[0].endswith(f", in the last second {late:.1f} degrees")
    page = (ROOT / "docs" / "own-robot.md").read_text(encoding="utf-8")
    shown = [line.strip() for line in page.splitlines() if " s, tilt at most " in line]
    # The last second of a balanced pole differs from machine to machine.
    differs = re.compile(r"(?<=neurons push: 10.0 s, tilt at most 5.7, in the last second )[\d.]+")
    assert [differs.sub("", line) for line in shown] == [differs.sub("", line) for line in printed]
    assert 0 < float(differs.findall(shown[0])[0]) < 0.5 * np.degrees(own_robot.TILT_RAD)


@pytest.mark.slow
def test_the_emulator_balances_the_pole_bit_for_bit_like_the_native_chip(own_robot, balanced):
    emulated = own_robot.balance(0.5, backend="nengo-loihi")
    assert np.array_equal(emulated, balanced[: len(emulated)])


def test_the_neurons_are_on_the_chip(own_robot):
    plant = own_robot.CartPole()
    with nengo.Network(seed=0) as network:
        balancer = own_robot.Balancer()
        Loop(plant, [own_robot.BalancePort(plant)]).connect([balancer.state], [balancer.force])
    assert compile_network(network).image.n_compartments >= 400


def test_a_perceptron_in_place_of_the_controller_balances_the_pole(own_robot):
    """Follow docs/own-robot.md on a policy of one's own, with layers in place of a file."""
    rng = np.random.RandomState(0)
    gains = own_robot.GAINS[np.newaxis]
    mixed = rng.uniform(0.5, 1.5, (8, 1)) * np.repeat([[1], [-1]], 4, axis=0)
    # Four units pass a positive force on, four a negative force, and each unit a quarter of it.
    layers = (Layer(mixed @ gains, np.zeros(8)), Layer(1 / (4 * mixed.T), np.zeros(1)))
    observations = rng.uniform(-1, 1, (500, 4)) * own_robot.RADII
    plant = own_robot.CartPole()
    loop = Loop(plant, [own_robot.BalancePort(plant)])
    with nengo.Network(seed=0) as network:
        net = perceptron(Mlp(layers, "relu"), observations, PolicyOptions(n_neurons=20))
        loop.connect([net.observation], [net.action])
    with Simulator(network, pipeline="compact") as sim:
        plant.reset(tilt_rad=own_robot.TILT_RAD)
        loop.begin()
        tilts = []
        for _ in range(4000):
            sim.step()
            tilts.append(plant.data.joint("hinge").qpos[0])
    assert np.abs(tilts).max() < 1.1 * own_robot.TILT_RAD
    assert np.abs(tilts[-1000:]).max() < 0.5 * own_robot.TILT_RAD


@pytest.fixture
def programs(monkeypatch):
    """Return the programs of the page, in its order; the first three make plant, port, network."""
    monkeypatch.chdir(EXAMPLE.parent)
    page = (ROOT / "docs" / "own-robot.md").read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)


def names_of(*programs):
    names = {}
    exec("\n".join(programs), names)
    return names


@pytest.mark.slow
def test_the_pages_network_balances_the_pole_in_a_command(programs):
    (made,) = (one for one in programs if one.startswith("def make()"))
    network = names_of(*programs[:3], made)["make"]()
    ran = run(network, SimulationOptions(steps=500))
    state = ran.recorded["state"]
    assert np.abs(state.values[:, 2]).max() < 0.11
    assert np.abs(state.values_float[:, 2]).max() < 0.11
    assert state.error() < 0.3


def test_the_pages_control_law_balances_the_pole_without_neurons(programs, capsys):
    (by_hand,) = (one for one in programs if "GAINS @ state" in one)
    names = names_of(*programs[:3], by_hand)
    assert names["plant"].time_s == pytest.approx(10.0)
    assert abs(names["state"][2]) < 0.001
    page = (ROOT / "docs" / "own-robot.md").read_text(encoding="utf-8")
    shown = page.partition(by_hand)[2].removeprefix("```\n\n").splitlines()[0]
    assert shown == f"    {capsys.readouterr().out.strip()}"


def test_the_pages_policy_balances_the_pole(programs, own_robot, monkeypatch, tmp_path):
    shutil.copy(own_robot.MODEL, tmp_path)
    monkeypatch.chdir(tmp_path)
    hidden, action = torch.nn.Linear(4, 8), torch.nn.Linear(8, 1)
    sign = torch.tensor([1.0, -1.0] * 4)
    with torch.no_grad():
        hidden.weight[:] = sign[:, None] * torch.tensor(own_robot.GAINS)
        action.weight[:] = sign / (4 * own_robot.MOST_N)
        for one in (hidden, action):
            one.bias.zero_()
    module = torch.nn.Sequential(hidden, torch.nn.ReLU(), action, torch.nn.Hardtanh())
    torch.jit.trace(module, torch.zeros(1, 4)).save("policy.pt")
    about_it = [one for one in programs if "observations.npz" in one]
    names = names_of(*programs[:2], *about_it)
    assert len(names["rows"]) >= 4 * 400
    assert names["plant"].time_s == pytest.approx(10.0)
    assert abs(names["plant"].data.joint("hinge").qpos[0]) < 0.5 * own_robot.TILT_RAD


def test_the_pages_robot_that_is_no_simulation_keeps_to_its_clock(programs):
    class Turned(Port):
        def observe(self):
            return np.empty(0)

        def drive(self, _values):
            pass

    (clocked,) = (one for one in programs if "has_own_clock" in one)
    motor = names_of(clocked)["Motor"]()
    loop = Loop(motor, [Turned()], motor.dt_s)
    motor.reset()
    loop.begin()
    for _ in range(5):
        loop.step(np.empty(0))
    assert motor.time_s >= 5 * motor.dt_s
