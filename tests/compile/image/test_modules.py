"""Energy by module, whose sum is the energy by core except for terms that depend on places."""

import nengo
import pytest

from spikeport.backends.loss import measure
from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.image.modules import by_module, modules
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.compile.report.report import Modules
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.energy import energy

PLACED = {"message", "hop_east_west", "hop_north_south", "message_between_chips"}


@pytest.fixture(scope="module")
def network() -> nengo.Network:
    """Return a network of a large ensemble in two pieces, between the host and a small one."""
    with nengo.Network(seed=1) as network:
        source = nengo.Node(0.5, label="source")
        large, small = nengo.Ensemble(1200, 1, label="large"), nengo.Ensemble(30, 1, label="small")
        nengo.Connection(source, large)
        nengo.Connection(large, small)
        nengo.Probe(small, synapse=0.01)
    return network


@pytest.fixture(scope="module")
def compilation(network: nengo.Network) -> Compilation:
    return compile_network(network)


def assert_adds_up(compilation: Compilation, whole: Activity, parts: Activity) -> None:
    chip = chips.get("loihi")
    found = Modules(modules(compilation.image), parts).energies(chip)
    assert [one.module for one in found["nahuku-fit"]] == list(modules(compilation.image))
    for calibration in chip.calibrations:
        terms = energy(whole, chip, calibration).terms
        of_no_place = sum(t.energy.value for t in terms if t.energy and t.event not in PLACED)
        by_parts = sum(one.energy_step.value for one in found[calibration.name] if one.energy_step)
        assert by_parts * whole.n_steps == pytest.approx(of_no_place)


@pytest.mark.slow
def test_modules_are_ensembles_relays_and_readouts(compilation: Compilation) -> None:
    assert modules(compilation.image) == ("large", "small", "large -> small", "small -> probes[0]")
    assert by_module(compilation.image).n_cores == 4


def test_expected_energies_of_modules_add_up(compilation: Compilation) -> None:
    image, rates = compilation.image, Rates(100.0, {"small": 20.0})
    parts = expected_activity(by_module(image), rates)
    assert_adds_up(compilation, expected_activity(image, rates), parts)


@pytest.mark.slow
def test_measured_energies_of_modules_add_up(
    network: nengo.Network, compilation: Compilation
) -> None:
    measured = measure(network, compilation, 0.05, seed=0, progress=lambda _what, _share: None)
    assert measured.activity.totals()["spikes"] > 0
    assert_adds_up(compilation, measured.activity, measured.by_module)


def test_ensembles_whose_labels_look_like_pieces_are_modules_of_their_own() -> None:
    with nengo.Network(seed=1) as network:
        for label in ("pool[1/2]", "pool[2/2]"):
            nengo.Ensemble(5, 1, label=label)
    assert modules(compile_network(network).image) == ("pool[1/2]", "pool[2/2]")
