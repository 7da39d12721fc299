"""Loading, checking and running an image without Nengo."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nengo
import numpy as np
import pytest

from spikeport.backends.decoding import Output
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network

N_STEPS = 40
PROGRAM = f"""
import json, sys
import numpy as np
from spikeport import ChipImage
from spikeport.backends.native.chip import NativeChip

image = ChipImage.load(sys.argv[1])
chip = NativeChip(image, seed=0)
held = [chip.step(np.array([step % image.n_inputs]), {{}})[0].tolist() for step in range({N_STEPS})]
odd = [m for m in sys.modules if m.partition(".")[0] in ("nengo", "nengo_loihi", "nengo_spa")]
print(json.dumps([held, odd]))
"""
NO_NENGO = ("numpy", "numba", "pydantic", "typer", "rich")


@pytest.fixture
def image() -> ChipImage:
    with nengo.Network(seed=3) as network:
        stimulus = nengo.Node([0.5, -0.2])
        a = nengo.Ensemble(40, 2, label="a")
        b = nengo.Ensemble(30, 1, label="b")
        nengo.Connection(stimulus, a)
        nengo.Connection(a, b, function=lambda x: x[0] * x[1])
        nengo.Probe(b, synapse=0.01)
    return compile_network(network).image


def expected(image: ChipImage) -> list[list[int]]:
    chip = NativeChip(image, seed=0)
    spikes = [np.array([step % image.n_inputs]) for step in range(N_STEPS)]
    return [chip.step(sources, {})[0].tolist() for sources in spikes]


@pytest.mark.slow
def test_running_an_image_imports_no_nengo(image: ChipImage, tmp_path: Path) -> None:
    image.save(tmp_path / "image.npz")
    command = [sys.executable, "-c", PROGRAM, str(tmp_path / "image.npz")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    held, odd = json.loads(done.stdout)
    assert odd == []
    assert held == expected(image)
    assert np.ptp(held) > 0


@pytest.mark.slow
def test_an_image_runs_where_no_nengo_is_installed(
    image: ChipImage, bare_environment: Callable[..., Callable[..., Any]], tmp_path: Path
) -> None:
    run = bare_environment(*NO_NENGO)
    image.save(tmp_path / "image.npz")
    missing = run("python", "-c", "from spikeport import ChipImage; import nengo", cwd=tmp_path)
    assert "No module named 'nengo'" in missing.stderr
    steps = np.arange(N_STEPS)
    np.savez(tmp_path / "spikes.npz", steps=steps, sources=steps % image.n_inputs)
    arguments = ("--steps", N_STEPS, "--spikes", "spikes.npz", "--out", "out.npz")
    done = run("spikeport", "step", "image.npz", *arguments, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    with np.load(tmp_path / "out.npz") as out:
        assert out["held_0"].tolist() == expected(image)
        decoded = [Output(image, 0).decode(row) for row in out["held_0"]]
        assert np.array_equal(out["values_0"], decoded)
    done = run("spikeport", "show", "image.npz", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert image.digest in done.stdout
