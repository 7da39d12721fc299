"""The cores as yosys maps them to the cells of an iCE40, against the native chip."""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from spikeport.backends.native.chip import NativeChip
from spikeport.backends.softcore.memory import MemoryImage
from spikeport.backends.softcore.simulation import Simulation
from spikeport.backends.softcore.verilated import FOLDER, Design, sources
from spikeport.backends.softcore.writer import written
from tests.helpers.fake_board import small_image, spike_train

CORES, UNIT = 2, 6
PARAMETERS = "-set CORES 2 -set CORE 1 -set LOG_COMPARTMENTS 5 -set WIDTH 16 -set LOG_QUEUE 2"
MEMORIES = "-set WORDS 40'h0010000100 -set AXONS 32'h00400040"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.proof,
    pytest.mark.skipif(
        any(shutil.which(name) is None for name in ("yosys", "verilator")),
        reason="no yosys or verilator: make referees",
    ),
]


@dataclass(frozen=True)
class Netlist:
    """A chip of two cores in cells of an iCE40, whose states are read by its port alone."""

    path: Path
    cells: Path
    cores: int = CORES
    unit: int = UNIT
    top: str = "chip"

    @property
    def files(self) -> list[Path]:
        return [self.path, self.cells, FOLDER / "simulation.cpp"]

    @property
    def options(self) -> list[str]:
        # Verilator does not read values of ports that are left out; there are none.
        options = ["-DNO_ICE40_DEFAULT_ASSIGNMENTS", "-Wno-fatal", "-Wno-lint", "-Wno-style"]
        # To optimise its C++ would take half a minute, and all steps take less than a second.
        return [*options, "-MAKEFLAGS", "OPT_FAST=-O0"]

    @property
    def include(self) -> dict[str, str]:
        return {}


@pytest.fixture(scope="module")
def netlist(tmp_path_factory: pytest.TempPathFactory) -> Design:
    path = tmp_path_factory.mktemp("netlist") / "netlist.v"
    script = f"read_verilog {' '.join(map(str, sources()))}; chparam {PARAMETERS} {MEMORIES} chip; "
    script += f"synth_ice40 -dsp -top chip; write_verilog -noattr {path}"
    subprocess.run(["yosys", "-q", "-p", script], check=True, timeout=600)
    assert "SB_RAM40_4K" in path.read_text()
    share = Path(str(shutil.which("yosys"))).resolve().parents[1] / "share"
    return Netlist(path, share / "yosys" / "ice40" / "cells_sim.v")


def states(simulation: Simulation, memory: MemoryImage) -> np.ndarray:
    """Return u, v and spike of every compartment, in the image's order."""
    held = np.empty((len(memory.order), 3), dtype=np.int64)
    at = iter(memory.order)
    for core, contents in enumerate(memory.cores):
        for place in range(len(contents.constants)):
            held[next(at)] = simulation.read(core, place)
    return held


def test_the_netlist_has_the_native_states(netlist: Design) -> None:
    memory, native = written(small_image(), UNIT, CORES), NativeChip(small_image(), 0)
    simulation = Simulation(memory, netlist)
    n, seen = len(memory.order), 0
    for spikes in spike_train(200):
        native.step(spikes, {})
        simulation.step(memory.messages(spikes))
        state = native.state
        expected = np.stack([state.u[:n], state.v[:n], state.spiked[:n]], axis=1)
        np.testing.assert_array_equal(states(simulation, memory), expected)
        seen += int(state.spiked[:n].sum())
    simulation.close()
    assert seen > 20
