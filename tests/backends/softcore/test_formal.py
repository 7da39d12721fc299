"""Bounded proofs of the queue, the bus, the barrier and the host's port, over every course."""

import shutil
import subprocess
from pathlib import Path

import pytest

from spikeport.backends.softcore.verilated import FOLDER, sources

CYCLES = {"queue_order": 14, "quiet_stays": 14, "bytes_counted": 22}
SCRIPT = "prep -top {top} -flatten; memory_map; opt; dffunmap; opt; sat -verify -prove-asserts -seq"

pytestmark = pytest.mark.skipif(shutil.which("yosys") is None, reason="no yosys: make referees")


def proved(top: str, folder: Path, change: tuple[str, str] = ("", "")) -> bool:
    """Return whether all assertions hold, after a change to the Verilog."""
    names = {path.name: path for path in (*sources(), FOLDER / "board" / "host.v")}
    parts = ("host.v",) if top == "bytes_counted" else ("queue.v", "bus.v", "barrier.v")
    text = "".join(names[name].read_text() for name in parts)
    assert change[0] in text
    (folder / "core.v").write_text(text.replace(*change) if change[0] else text)
    read = f"read_verilog -formal core.v {FOLDER / 'formal' / top}.v"
    script = f"{read}; {SCRIPT.format(top=top)} {CYCLES[top]}"
    done = subprocess.run(["yosys", "-q", "-p", script], cwd=folder, capture_output=True, text=True)
    assert not done.returncode or "proof did fail" in done.stdout + done.stderr
    return done.returncode == 0


@pytest.mark.parametrize("top", CYCLES)
def test_the_assertions_hold(top: str, tmp_path: Path) -> None:
    assert proved(top, tmp_path)


@pytest.mark.parametrize(
    ("top", "change"),
    [
        ("queue_order", ("assign ready = !held[LOG_DEPTH];", "assign ready = 1'b1;")),
        ("queue_order", ("seen <= written;", "seen <= written + 1'b1;")),
        ("quiet_stays", (" & bus_empty & !go;", " & !go;")),
        ("quiet_stays", ("else if (valid) valid <= !moved", "else if (0) valid <= 0")),
        ("bytes_counted", ("patience[LOG_PATIENCE] & !taken;", "patience[LOG_PATIENCE];")),
    ],
)
def test_the_proof_fails_for_a_fault_in_the_verilog(
    top: str, change: tuple[str, str], tmp_path: Path
) -> None:
    assert not proved(top, tmp_path, change)
