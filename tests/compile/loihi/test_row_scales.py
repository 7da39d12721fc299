"""Scales of rows of weights, before there are any blocks."""

import nengo
import numpy as np
import pytest
import scipy.sparse as sparse
from nengo_loihi.block import Compartment

from spikeport.compile.loihi.row_scales import RowScales, exponents
from spikeport.compile.loihi.solver import ParameterSolver
from tests.helpers.small_networks import DT_S, rewrite_of

N = 32
GAINS = np.geomspace(0.01, 10, N)
WEIGHTS = sparse.csr_array(GAINS[:, np.newaxis] * np.linspace(0.1, 1, 20) / DT_S, dtype=np.float32)
"""Weights into neurons whose gains span a factor of a thousand."""


@pytest.fixture(scope="module")
def compartment() -> Compartment:
    with nengo.Network(seed=6, label="wide") as network:
        post = nengo.Ensemble(N, 1, gain=GAINS, bias=0.9 * np.ones(N))
        nengo.Connection(nengo.Node([0.5]), post)
    found = ParameterSolver(rewrite_of(network), DT_S).compartment(post)
    found.tau_s = None
    found.configure_filter(0.005, dt=DT_S)
    return found


def largest() -> np.ndarray:
    return np.asarray(abs(WEIGHTS).max(axis=1).toarray()).ravel()


def test_rows_of_one_size_are_not_scaled(compartment: Compartment) -> None:
    assert not exponents(compartment, np.full(N, 10.0), 8).any()


@pytest.mark.parametrize("profiles", [1, 2, 8])
def test_larger_rows_are_scaled_more_by_at_most_as_many_powers_as_there_are_profiles(
    compartment: Compartment, profiles: int
) -> None:
    k = exponents(compartment, largest(), profiles)
    assert np.all(np.diff(k) >= 0)
    assert len(set(k.tolist())) <= profiles
    assert (k[-1] > k[0]) == (profiles > 1)


def test_more_profiles_lose_less_of_small_rows(compartment: Compartment) -> None:
    shares = []
    for profiles in (1, 8):
        scales = RowScales.of(compartment, largest(), profiles)
        assert scales is not None
        lost = abs(scales.lost(WEIGHTS)).max(axis=1).toarray().ravel() / largest()
        shares.append(lost[: N // 2].mean())
    assert shares[1] < shares[0] / 4


def test_coarse_thresholds_have_an_error(compartment: Compartment) -> None:
    scales = RowScales.of(compartment, largest(), 8)
    assert scales is not None
    finer = RowScales(scales.k, {**scales.info, "v_scale": 2 * scales.info["v_scale"]}, scales.vth)
    assert finer.coarseness() == pytest.approx(scales.coarseness() / 2)
