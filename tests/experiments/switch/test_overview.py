"""The overview of a network: its populations, its connections between parts, its drawing."""

import nengo
import pytest

from spikeport.experiments.switch import overview
from spikeport.networks.action_selection import action_selection
from spikeport.networks.humanoid import HumanoidNetwork

PARTS = ("selection", "arm", "follower", "policy")


@pytest.fixture
def network() -> HumanoidNetwork:
    """Return a humanoid of small parts, in which the selection silences the arm."""
    made = HumanoidNetwork(seed=0)
    with made:
        for name in PARTS:
            with nengo.Network(label=name) as part:
                part.ensembles_of = [nengo.Ensemble(4, 1, label=f"unit {i}+") for i in range(2)]
                nengo.Ensemble(3, 1, label="speed")
                part.out = nengo.Node(size_in=1)
            setattr(made, name, part)
        gate, arm = made.selection.ensembles_of[0], made.arm.ensembles_of[0]
        nengo.Connection(gate.neurons[:2], arm.neurons, transform=[[1, 1]] * 4)
        nengo.Connection(made.arm.ensembles_of[1], made.arm.out)
    return made


def test_populations_whose_names_differ_only_in_numbers_are_merged(network):
    assert overview.populations(network.policy) == {"unit+": 8, "speed": 3}


def test_names_that_end_in_a_digit_stay_apart():
    nuclei = overview.populations(action_selection(2))
    assert {"strD1", "strD2"} <= set(nuclei)
    with nengo.Network() as arm:
        for axis in "xy":
            nengo.Ensemble(5, 1, label=f"M1 {axis}")
    assert overview.populations(arm) == {"M1 x": 5, "M1 y": 5}


def test_arrows_are_the_connections_between_parts(network):
    parts = {name: getattr(network, name) for name in PARTS}
    assert overview.arrows(network, parts) == [("selection", "arm")]


def test_every_part_is_drawn_with_its_neurons(network, tmp_path):
    with nengo.Network() as run:
        run.add(network)
    drawn = overview.overview_figure(run)
    texts = [text.get_text() for text in drawn.axes[0].texts]
    for name in PARTS:
        assert f"{name}: 11 neurons" in texts
    assert "unit+: 8" in texts
    drawn.savefig(tmp_path / "overview.png")
