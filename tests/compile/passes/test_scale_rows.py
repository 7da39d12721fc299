"""`ScaleRows`: compartments scaled by powers of two, so that small weights survive rounding."""

import nengo
import numpy as np
import pytest
from nengo_loihi.block import LoihiBlock

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.blocks import FloatBlocks
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.passes.scale_rows import ScaleRows
from tests.helpers.same_run import context

N = 32


def wide(probe: str = "output", weight: float = 1e-3) -> nengo.Network:
    """Return neurons whose gains span a factor of a thousand."""
    with nengo.Network(seed=6, label="wide") as network:
        gains = np.geomspace(0.01, 10, N)
        pre = nengo.Ensemble(20, 1, label="pre")
        post = nengo.Ensemble(N, 1, gain=gains, bias=0.9 * np.ones(N), label="post")
        nengo.Connection(
            pre.neurons, post.neurons, transform=np.full((N, 20), weight), synapse=0.005
        )
        nengo.Probe(post.neurons, probe)
    return network


def floats_of(
    network: nengo.Network, scale: ScaleRows | None
) -> tuple[LoihiBlock, dict[str, np.ndarray]]:
    """Return the discretised block "post", and the values before."""
    floats = build(Rewrite(network, Names(network)), 0.001)
    before = vth_of(floats)
    if scale is not None:
        scaled = scale.apply(floats, context())
        assert vth_of(floats) == before  # a pass changes nothing in place
        floats = scaled
    block = floats.blocks[1]
    values = {
        "vth": block.compartment.vth,
        "bias": block.compartment.bias,
        "weights": np.vstack(block.synapses[0].weights),
    }
    return discretise(floats).blocks[1], values


def vth_of(floats: FloatBlocks) -> list[list[float]]:
    return [block.compartment.vth.tolist() for block in floats.blocks]


def test_thresholds_biases_and_weights_are_scaled_by_the_same_powers_of_two() -> None:
    _, before = floats_of(wide(), None)
    _, after = floats_of(wide(), ScaleRows(profiles=8))
    factor = after["vth"] / before["vth"]
    assert 4 < len(np.unique(factor)) <= 8
    assert np.array_equal(np.log2(factor), np.round(np.log2(factor)))
    assert np.array_equal(after["bias"], before["bias"] * factor)
    assert np.array_equal(after["weights"], before["weights"] * factor)


def test_compartments_with_the_smallest_weights_keep_their_threshold() -> None:
    _, before = floats_of(wide(), None)
    _, after = floats_of(wide(), ScaleRows(profiles=8))
    assert np.array_equal(after["vth"][:3], before["vth"][:3])


def test_weights_of_small_gains_are_not_rounded_to_zero() -> None:
    plain, _ = floats_of(wide(), None)
    scaled, _ = floats_of(wide(), ScaleRows(profiles=8))
    lost = [np.mean(np.vstack(b.synapses[0].weights) == 0) for b in (plain, scaled)]
    assert lost[0] > 0.2
    assert lost[1] == 0


@pytest.mark.parametrize("weight", [1e-3, 1e-4, 1e-5])
def test_no_weight_loses_bits_even_if_the_threshold_sets_the_scale(weight: float) -> None:
    network = wide(weight=weight)
    _, values = floats_of(network, None)
    exact = values["weights"][0] / values["weights"].max()
    errors = []
    for scale in (None, ScaleRows(profiles=8)):
        block, _ = floats_of(network, scale)
        # Relative to the threshold and to the largest weight, which has 8 bits if any weight has.
        found = block.synapses[0].weights[0][0] / block.compartment.vth
        errors.append(np.abs(found / found[-1] - exact) / exact)
    before, after = errors
    assert (after <= before + 1 / 128).all()
    assert (after.mean() < before.mean() / 2) == (weight > 1e-5)


def test_a_block_has_no_more_thresholds_than_profiles() -> None:
    for profiles in (1, 2, 3):
        block, _ = floats_of(wide(), ScaleRows(profiles=profiles))
        assert len(np.unique(block.compartment.vth)) <= profiles


def test_blocks_whose_voltage_is_probed_are_not_scaled() -> None:
    _, before = floats_of(wide("voltage"), None)
    _, after = floats_of(wide("voltage"), ScaleRows(profiles=8))
    assert np.array_equal(before["vth"], after["vth"])


def test_weights_that_are_zero_up_to_rounding_do_not_set_a_threshold() -> None:
    with nengo.Network(seed=1) as network:
        pre = nengo.Ensemble(20, 1, label="pre")
        post = nengo.Ensemble(N, 1, gain=np.ones(N), bias=0.9 * np.ones(N), label="post")
        sizes = np.where(np.arange(N) < N // 2, 1e-15, 1e-3)[:, None]
        nengo.Connection(pre.neurons, post.neurons, transform=sizes * np.ones((N, 20)))
    block, _ = floats_of(network, ScaleRows())
    assert np.unique(block.compartment.vth).size == 1
    with_weights = np.vstack(block.synapses[0].weights).any(axis=0)
    assert with_weights.tolist() == [False] * (N // 2) + [True] * (N // 2)
