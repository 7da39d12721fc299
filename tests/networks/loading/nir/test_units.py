"""Weights in units of the chip: their ratios to the threshold, and sums within its registers."""

import numpy as np
import pytest
from scipy import sparse

from spikeport.networks.loading.nir import units as module
from spikeport.networks.loading.nir.dynamics import dynamics
from spikeport.networks.loading.nir.graph import Node
from spikeport.networks.loading.nir.populations import Population
from spikeport.networks.loading.nir.signals import Signal
from spikeport.networks.loading.nir.units import CURRENT, INPUT, parts, units
from spikeport.reading.mismatch import MismatchError

DT_S = 1e-3


def population(weights: np.ndarray, bias: np.ndarray | float = 0.0, **values: object) -> Population:
    """Return neurons with a filtered current, a weight of 1 being a quarter of the threshold."""
    n = len(weights)
    taus = {"tau_syn": 4e-3, "tau_mem": 1e-2, "r": 10.0, "v_leak": 0.0, "v_threshold": 1.0}
    all_of = {name: np.full(n, value) for name, value in {**taus, **values}.items()}
    node = Node("n", "CubaLIF", all_of)
    signal = Signal({"i": sparse.csr_matrix(weights)}, np.broadcast_to(bias, n), (n,), {"i": 0})
    return Population(node, dynamics(node, (n,), DT_S), signal, 1)


@pytest.mark.parametrize("n_parts", [1, 2])
def test_scaling_keeps_the_ratio_of_weights_to_the_threshold(n_parts):
    rng = np.random.default_rng(0)
    weights = rng.normal(0, 1, (30, 50)) * rng.choice([1, 0.1], (30, 1))
    found = units(population(weights, bias=0.2), n_parts)
    ratio = found.threshold[:, np.newaxis] / 4
    np.testing.assert_allclose(found.weights["i"].toarray(), weights * ratio)
    np.testing.assert_allclose(found.constants[0], 0.2 * ratio[:, 0])
    assert not found.constants[1:].any()
    assert len(np.unique(found.threshold)) <= module.LEVELS


def test_no_input_wraps_a_register_around():
    weights = np.random.default_rng(0).normal(0, 1, (10, 400))
    found = units(population(weights), 2)
    weights = found.weights["i"].toarray()
    sums = np.abs([weights.clip(min=0).sum(axis=1), weights.clip(max=0).sum(axis=1)])
    assert INPUT / 4 < np.max(sums) <= INPUT
    assert np.max(sums) / 0.25 <= CURRENT


def test_weights_keep_more_bits_if_only_a_share_of_sources_spikes_at_once():
    weights = np.random.default_rng(0).normal(0, 1, (10, 400))
    all_of, eighth, few = (units(population(weights), 2, share) for share in (1.0, 0.125, 1e-3))
    assert (eighth.threshold > 1.5 * all_of.threshold).all()
    largest = np.sort(eighth.weights["i"].toarray(), axis=1)[:, -50:]
    assert INPUT / 2 < largest.sum(axis=1).max() <= INPUT
    assert (few.threshold == module.DEEP).all()
    assert np.abs(few.weights["i"].data).max() <= 127 * 2.0**14


def test_thresholds_are_few_and_as_large_as_registers_allow():
    weights = np.random.default_rng(0).normal(0, 1, (10, 400)) * np.linspace(0.5, 4, 10)[:, None]
    found = units(population(weights), 2)
    # Sums of absolute values are no less than sums of one sign.
    safe = INPUT / np.abs(weights).sum(axis=1)
    assert len(np.unique(found.threshold)) == module.LEVELS
    assert (found.threshold % module.UNIT == 0).all()
    assert (found.threshold > safe).mean() > 0.5


def test_whole_weights_stay_whole():
    weights = np.random.default_rng(0).integers(-90, 90, (10, 40)).astype(float)
    for threshold in (512.0, 700.0):
        same = {"tau_syn": DT_S, "tau_mem": DT_S, "r": 1.0, "v_threshold": threshold}
        found = units(population(weights, **same), 2)
        scale = found.threshold[:, np.newaxis] / threshold
        assert not np.modf(np.log2(scale))[0].any()
        mine = np.round(found.weights["i"].toarray(), 6)
        np.testing.assert_array_equal(mine, weights * scale)
        assert not (mine % module.UNIT).any()


def test_the_rounding_of_a_bias_on_the_chip_is_corrected():
    found = units(population(np.zeros((5, 3)), bias=np.linspace(0.1, 0.3, 5), tau_syn=7e-3), 2)
    bias, decay = found.constants[0], round(4096 / 7) / 4096
    settled = np.round(bias / 64) * 64 / decay + found.correction
    np.testing.assert_allclose(settled, 7 * bias, atol=0.5)
    assert found.correction.any()
    assert not units(population(np.ones((5, 3))), 2).correction.any()


def test_neurons_that_do_not_leak_keep_room_for_inhibition():
    """Without a leak, a voltage can fall for ever; with a leak or only excitation, it cannot."""
    fire = Node("n", "IF", {"r": np.ones(1), "v_threshold": np.ones(1)})
    found = []
    for sign, node in ((1, fire), (-1, fire), (-1, None)):
        one = population(sign * np.full((1, 2), 0.13))
        if node is not None:
            one = Population(node, dynamics(node, (1,), DT_S), one.input, 1)
        found.append(units(one, 2).threshold[0])
    assert found[1] == module.DEEP
    assert min(found[0], found[2]) > module.DEEP


def test_a_single_synapse_for_each_weight_uses_all_its_bits():
    weights = np.random.default_rng(0).normal(0, 1, (10, 40))
    largest = np.abs(units(population(weights), 1).weights["i"].data).max()
    step = 2.0 ** np.ceil(np.log2(largest / 127))
    assert 126 < largest / step <= 127.5


def test_weights_that_would_exactly_fill_a_register_are_scaled_below_it():
    one, four = (
        units(population(np.full((1, n), 4 / n), tau_syn=DT_S, w_in=0.25), 2) for n in (1, 4)
    )
    for found in (one, four):
        assert found.weights["i"].sum() == found.threshold[0] == 2.0**20


def test_a_second_part_holds_the_rest_that_8_bits_lose():
    matrix = sparse.csr_matrix(np.random.default_rng(0).normal(0, 2**18, (10, 20)))
    coarse, fine = parts(matrix, 2)
    np.testing.assert_array_equal((coarse + fine).toarray(), matrix.toarray())
    step = 2.0 ** np.ceil(np.log2(np.abs(matrix.data).max() / 127))
    assert set(coarse.data % step) == {0}
    assert np.abs(fine.data).max() <= step / 2
    (only,) = parts(matrix, 1)
    assert (only != matrix).nnz == 0


def test_weights_of_many_times_the_threshold_are_refused():
    with pytest.raises(MismatchError) as caught:
        units(population(np.full((1, 1), 1e5), tau_mem=8e-3, r=8.0), 2)
    assert str(caught.value) == (
        "expected weights of at most 127.5 times the threshold, or sums of at most 16,384 times "
        "it, in node n, found 25,000"
    )


def test_a_neuron_that_is_switched_off_by_its_threshold_leaves_the_others_their_bits():
    weights = np.random.default_rng(0).normal(0, 1, (8, 6))
    threshold = np.ones(8)
    threshold[0] = 2.0**63
    found = units(population(weights, v_threshold=threshold), 2)
    usual = units(population(weights), 2)
    assert (found.threshold[1:] >= usual.threshold[1:] / 2**module.LEVELS).all()
