"""The image on Lava's fixed-point CPU models, in a process and an environment of its own.

Lava is archived, and runs on Python 3.10 alone, so it is no dependency. `make referees` installs it
apart from spikeport; LAVA_PYTHON names the Python of another place that has it.

Lava's own neurons have neither a refractory delay nor a lower bound of the voltage. So an image as
compiled runs there on neurons of spikeport's, in Lava's arithmetic, and an image without both runs
on Lava's own neurons.
"""

import dataclasses
import os
from pathlib import Path

import nengo
import numpy as np
import pytest

from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network
from tests.helpers.lava_witness import ran_on_lava

INSTALLED = Path(__file__).parents[2] / ".referees" / "lava" / "bin" / "python"
PYTHON = Path(os.environ.get("LAVA_PYTHON", INSTALLED))
N_STEPS = 100
LOWEST = -(2**23) + 1

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.is_file(), reason="Lava is absent (Python 3.10): make referees"),
]


@pytest.fixture(scope="module")
def image() -> ChipImage:
    """Return an image of two ensembles, one of which feeds itself, with inputs from the host."""
    with nengo.Network(seed=2) as network:
        value = nengo.Node(np.sin)
        first, second = nengo.Ensemble(40, 2, label="first"), nengo.Ensemble(50, 1, label="second")
        nengo.Connection(value, first[0])
        nengo.Connection(first, second, function=lambda x: x[0] - x[1])
        nengo.Connection(second, second, synapse=0.1)
        nengo.Probe(second)
    return compile_network(network).image


def alike(image: ChipImage) -> ChipImage:
    """Return the image with neurons that Lava has: all alike, without rest or lower bound."""
    each, blocks = image.compartments, image.blocks
    same = {
        "decay_u": np.full_like(each.decay_u, 700),
        "decay_v": np.full_like(each.decay_v, 200),
        "vth": np.full_like(each.vth, 300 << 6),
        "bias": each.bias >> 6 << 6,
        "refract_delay": np.ones_like(each.refract_delay),
    }
    ends = {"vmin": np.full_like(blocks.vmin, LOWEST), "vmax": np.full_like(blocks.vmax, -LOWEST)}
    return dataclasses.replace(
        image,
        compartments=dataclasses.replace(each, **same),
        blocks=dataclasses.replace(blocks, **ends),
    )


def sent(image: ChipImage) -> np.ndarray:
    return (np.random.RandomState(0).rand(N_STEPS, image.n_inputs) < 0.4).astype(np.int32)


def native(image: ChipImage, spikes: np.ndarray) -> dict[str, np.ndarray]:
    chip, states = NativeChip(image, seed=0), []
    for step in spikes:
        chip.step(np.flatnonzero(step), {})
        state = chip.state
        states.append((state.u.copy(), state.v.copy(), state.spiked[: len(state.v)].copy()))
    u, v, spiked = (np.array(column, dtype=np.int64) for column in zip(*states, strict=True))
    return {"u": u, "v": v, "spiked": spiked}


@pytest.mark.parametrize("stock", [False, True])
def test_lava_computes_the_same_states_bit_for_bit(
    image: ChipImage, stock: bool, tmp_path: Path
) -> None:
    taken = alike(image) if stock else image
    spikes = sent(taken)
    ours, theirs = native(taken, spikes), ran_on_lava(PYTHON, taken, spikes, tmp_path, stock)
    assert ours["spiked"].sum() > 500
    for name, wanted in ours.items():
        np.testing.assert_array_equal(theirs[name], wanted, err_msg=name)
