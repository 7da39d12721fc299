"""Energy and time against SANA-FE's Loihi model, in a process and an environment of its own.

SANA-FE is GPL-3.0 and not a dependency. `make referees` installs it apart from spikeport;
SANAFE_PYTHON names the Python of another place that has it.

Both count the same spikes: every neuron of an image spikes with a period of its own, and reaches
its targets along the image's wiring and placement. The host's spikes to the arm are left out, since
SANA-FE has no host.
"""

import json
import os
import subprocess
from pathlib import Path

import nengo
import numpy as np
import pytest

from spikeport.backends.counter import Counter
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import synapses_of
from spikeport.compile.image.fanout import fanout
from spikeport.compile.pipeline import compile_network
from spikeport.find_network import find_network
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.energy import EnergyReport, energy
from spikeport.hardware_models.timing import timing

INSTALLED = Path(__file__).parents[2] / ".referees" / "sanafe" / "bin" / "python"
PYTHON = os.environ.get("SANAFE_PYTHON", INSTALLED)
N_STEPS = 100
CORES_PER_TILE = 4
ARM = "merge_axons,split,pack,place"
TERMS = {
    "synapse": ("synaptic_operation",),
    "soma": ("update_active", "spike"),
    "network": ("message", "hop_east_west", "hop_north_south"),
}
"""SANA-FE's sums, and the events of ours that each holds."""
SIMULATE = f"""
import json, os, sys, sanafe
folder = os.path.dirname(sanafe.__file__)
arch = sanafe.load_arch(os.path.join(folder, "examples", "loihi.yaml"))
chip = sanafe.SpikingChip(arch)
chip.load(sanafe.load_net(sys.argv[1], arch, use_netlist_format=True))
result = chip.sim({N_STEPS})
names = ("energy", "neurons_fired", "sim_time")
json.dump({{name: result[name] for name in names}}, open(sys.argv[2], "w"))
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path(PYTHON).is_file(), reason="SANA-FE is absent: make referees"),
]


def arm() -> ChipImage:
    """Return the arm on two tiles, with few synapses, and with the passes of its runs."""
    made = compile_network(find_network("arm", ["s1=10"]), pipeline=ARM).image
    assert made.n_cores > CORES_PER_TILE
    return made


def ring() -> ChipImage:
    """Return an image of twelve cores on three tiles, each wired to three others and to itself."""
    rng = np.random.RandomState(1)
    with nengo.Network(seed=1) as network:
        groups = [nengo.Ensemble(20, 1, gain=np.ones(20), bias=np.ones(20)) for _ in range(12)]
        for i, pre in enumerate(groups):
            for step in (0, 1, 5, 7):
                weights = rng.uniform(0.1, 1, (20, 20))
                post = groups[(i + step) % 12]
                nengo.Connection(pre.neurons, post.neurons, transform=weights, synapse=0.005)
    return compile_network(network, pipeline="").image


@pytest.fixture(scope="module", params=[ring, arm], ids=["ring", "arm"])
def image(request: pytest.FixtureRequest) -> ChipImage:
    made: ChipImage = request.param()
    return made


@pytest.fixture(scope="module")
def periods(image: ChipImage) -> np.ndarray:
    return np.random.RandomState(2).randint(2, 30, image.n_compartments)


def counted(image: ChipImage, periods: np.ndarray) -> Activity:
    """Return the counts of neurons that spike in every step which their period divides."""
    dt_s = image.manifest.dt_s
    counter = Counter(image.cores, dt_s, image.compartment_core, fanout(image))
    always = np.ones(image.n_compartments, dtype=bool)
    for step in range(1, N_STEPS + 1):
        spiked = step % periods == 0
        counter.step(np.flatnonzero(spiked), spiked, always)
    return counter.activity()


def netlist(image: ChipImage, periods: np.ndarray) -> str:
    """Return the image in SANA-FE's format, with biases of 1 and thresholds just below periods."""
    n = image.n_compartments
    lines = [f"g {n} soma_hw_name=loihi_lif synapse_hw_name=loihi_dense_synapse leak_decay=1"]
    lines += [f"n 0.{i} bias=1 threshold={period - 0.5}" for i, period in enumerate(periods)]
    for synapses in synapses_of(image):
        pairs = zip(synapses.source, synapses.target, strict=True)
        lines += [f"e 0.{source}->0.{target} weight=0" for source, target in pairs if source < n]
    cores = [divmod(core, CORES_PER_TILE) for core in image.compartment_core]
    lines += [f"& 0.{i}@{tile}.{core}" for i, (tile, core) in enumerate(cores)]
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def theirs(image: ChipImage, periods: np.ndarray, tmp_path_factory) -> dict:
    folder: Path = tmp_path_factory.mktemp("sanafe")
    net, result = folder / "net", folder / "result.json"
    net.write_text(netlist(image, periods))
    subprocess.run([PYTHON, "-c", SIMULATE, net, result], check=True, cwd=folder, timeout=600)
    return json.loads(result.read_text())


@pytest.fixture(scope="module")
def ours(image: ChipImage, periods: np.ndarray) -> EnergyReport:
    loihi = chips.get("loihi")
    return energy(counted(image, periods), loihi, loihi.calibration("nahuku-fit"))


@pytest.fixture(scope="module")
def our_time(image: ChipImage, periods: np.ndarray) -> float:
    """Return time of all steps, in s."""
    loihi = chips.get("loihi")
    steps = timing(counted(image, periods), loihi, loihi.calibration("nahuku-fit"))
    return N_STEPS * steps.mean.value


def test_both_count_the_same_spikes(theirs: dict, ours: EnergyReport) -> None:
    spikes = {term.event: term.count for term in ours.terms}["spike"]
    assert spikes == theirs["neurons_fired"] > 1000


@pytest.mark.parametrize("name", TERMS)
def test_energies_agree_to_1_percent(theirs: dict, ours: EnergyReport, name: str) -> None:
    terms = {term.event: term.energy.value for term in ours.terms if term.energy is not None}
    assert sum(terms[event] for event in TERMS[name]) == pytest.approx(
        theirs["energy"][name], rel=0.01
    )


def test_total_energies_agree_to_1_percent(theirs: dict, ours: EnergyReport) -> None:
    assert ours.dynamic_run.value == pytest.approx(theirs["energy"]["total"], rel=0.01)


def test_times_of_steps_agree_to_25_percent(theirs: dict, our_time: float) -> None:
    # In SANA-FE a core's work and messages overlap, and messages wait for each other on their way.
    assert 0.75 < our_time / theirs["sim_time"] < 1.25
