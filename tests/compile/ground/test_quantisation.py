import numpy as np
import pytest
from nengo_loihi.block import LoihiBlock, Synapse
from nengo_loihi.builder import Model

from spikeport.compile.ground.quantisation import BlockError, block_values, relative_rms
from spikeport.compile.image.manifest import BlockEntry
from spikeport.compile.loihi.blocks import FloatBlocks
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.pipeline import Compilation


def discretised(
    weights: np.ndarray, bias: np.ndarray, vth: float = 1.0, tau_s: float = 0.005
) -> tuple[LoihiBlock, BlockError]:
    """Return a block of LIF neurons with one weight row an axon, and its quantisation error."""
    block = LoihiBlock(len(bias))
    block.compartment.configure_lif(vth=vth)
    block.compartment.configure_filter(tau_s)
    block.compartment.bias[:] = bias
    model = Model()
    model.add_block(block)
    with numpy1_semantics():
        if weights.size:
            synapse = Synapse(len(weights))
            synapse.set_weights(weights)
            block.add_synapse(synapse)
    entry = BlockEntry("ensemble", "block")
    blocks = discretise(FloatBlocks(model, (block,), (entry,), (), ()))
    return blocks.blocks[0], blocks.errors[0]


def test_errors_are_relative_to_the_wanted_values() -> None:
    wanted = np.array([[3.0, 0.0], [0.0, 4.0]])
    assert relative_rms(wanted, wanted) == 0
    assert relative_rms(np.array([[3.0, 1.0], [0.0, 4.0]]), wanted) == pytest.approx(0.2)
    assert relative_rms(wanted, 0 * wanted) == 0


def test_the_error_is_the_relative_rms_change_by_rounding() -> None:
    rng = np.random.RandomState(1)
    weights, bias = rng.uniform(-1, 1, (7, 5)), rng.uniform(0, 2, 5)
    block, error = discretised(weights, bias)
    info = block.discretize_info
    wanted, restored = [], []
    for row, integers in zip(weights, block.synapses[0].weights, strict=True):
        for target in range(5):
            wanted.append(np.float32(row[target]))
            restored.append(integers[0, target] / (info["w_scale"] * 2.0 ** (6 + info["w_exp"])))
    difference = np.subtract(restored, wanted)
    assert error.weights == pytest.approx(np.linalg.norm(difference) / np.linalg.norm(wanted))
    change = block.compartment.bias / info["b_scale"] - np.float32(bias)
    assert error.bias == pytest.approx(np.linalg.norm(change) / np.linalg.norm(bias), rel=1e-5)
    assert 0 < error.weights < 0.02
    assert 0 < error.bias < 0.02


def test_the_largest_weight_loses_one_part_in_255() -> None:
    # The weight is scaled to 255, but the chip holds only even weights, up to 254, and signs.
    _, error = discretised(np.ones((1, 1)), np.ones(1))
    assert error.weights == pytest.approx(1 / 255)


def test_a_block_without_weights_and_biases_has_no_error() -> None:
    _, error = discretised(np.zeros((0, 4)), np.zeros(4))
    assert error[:4] == BlockError("block", 0.0, 0.0, 0.0)[:4]


def test_errors_of_threshold_and_decays_are_those_of_their_integers() -> None:
    block, error = discretised(np.ones((1, 2)), np.ones(2), tau_s=0.005)
    comp, scale = block.compartment, block.discretize_info["v_scale"]
    wanted = -np.expm1(-0.001 / np.array([0.005, 0.02]))  # of current and voltage
    assert error.threshold == pytest.approx(abs(comp.vth[0] / scale - 1))
    found = (comp.decay_u[0] + 1) / 4096, comp.decay_v[0] / 4096
    errors = np.abs(found - wanted) / wanted
    assert [error.current_decay, error.voltage_decay] == pytest.approx(errors, abs=1e-6)
    assert 0 < max(errors) < 0.01


def test_weights_of_zero_have_no_error_and_are_not_lost() -> None:
    _, error = discretised(np.zeros((3, 4)), np.ones(4))
    assert (error.weights, error.lost_weights) == (0.0, 0.0)


def test_a_bias_that_the_chip_can_hold_has_no_error() -> None:
    # Without weights the largest bias is scaled to the chip's largest, 4095 * 2**7, and halved
    # until the threshold fits; a mantissa of 4095 stays as it is.
    block, error = discretised(np.zeros((0, 2)), np.array([1.0, 0.0]))
    assert block.compartment.bias[0] % 4095 == 0
    assert error.bias < 1e-7


def test_small_weights_beside_a_large_one_are_lost() -> None:
    # Weights below 1/255 of the largest round to zero: two of the three that are not zero.
    _, error = discretised(np.array([[1.0, 1e-3, -1e-3, 0.0]]), np.ones(4))
    assert error.lost_weights == pytest.approx(2 / 3)


def test_weights_that_only_rounding_keeps_from_zero_are_not_lost() -> None:
    _, error = discretised(np.array([[1.0, 0.5, 1e-14, -1e-16]]), np.ones(4))
    assert error.lost_weights == 0


def test_block_values_are_the_biases_and_the_rows_of_weights() -> None:
    block = LoihiBlock(2)
    block.compartment.bias[:] = [1, 2]
    synapse = Synapse(1)
    with numpy1_semantics():
        synapse.set_weights(np.array([[3.0, 4.0]]))
    block.add_synapse(synapse)
    values = block_values(block)
    assert values.bias.tolist() == [1, 2]
    assert np.concatenate(values.weights).tolist() == [3, 4]
    assert np.concatenate(values.indices).tolist() == [0, 1]


def test_every_block_of_a_network_has_an_error_in_the_report(compiled_chain: Compilation) -> None:
    errors = compiled_chain.report.errors
    assert [error.label for error in errors] == list(compiled_chain.image.cores)
    assert all(0 < error.weights < 0.05 for error in errors)


def test_shared_rows_of_a_convolution_have_an_error(compiled_convolution: Compilation) -> None:
    errors = {error.label: error for error in compiled_convolution.report.errors}
    assert 0 < errors["maps[1/2]"].weights < 0.05
    assert errors["image"].weights == 0
