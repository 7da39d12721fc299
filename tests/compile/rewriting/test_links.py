"""Decoded connections as matrices."""

from dataclasses import replace

import nengo
import numpy as np
import scipy.sparse as sparse

from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.links import link
from tests.helpers.small_networks import (
    DT_S,
    FAST,
    LINK,
    decode,
    decoders,
    ensemble,
    rewrite_of,
)


def test_a_link_has_decoders_in_units_of_the_radius() -> None:
    with nengo.Network(seed=1) as network:
        a, b = ensemble("a", 4), ensemble("b", 3, 2, radius=0.5, neuron_type=nengo.LIF(tau_rc=0.04))
        made = decode(a, b[1], values := decoders(4, 1), transform=3, synapse=FAST)
    found = link(made, ParameterSolver(rewrite_of(network), DT_S))
    expected = np.vstack([np.zeros((1, 4)), 3 * values.T / 0.5])
    np.testing.assert_allclose(found.decoders.toarray(), expected)
    np.testing.assert_array_equal(found.encoders.toarray(), [[1, 2], [3, 4], [5, 6]])
    np.testing.assert_array_equal(found.gains, [1, 2, 3])


def test_weights_of_a_link_are_encoders_times_decoders_of_each_neuron() -> None:
    weights = (LINK.encoders @ LINK.decoders).toarray()
    np.testing.assert_array_equal(LINK.transform, weights)
    assert LINK.n_weights == np.count_nonzero(weights)
    apart = replace(LINK, encoders=sparse.csr_array(LINK.encoders.toarray() * np.eye(3, 2)))
    few = (apart.encoders @ apart.decoders).toarray()
    assert isinstance(apart.transform, nengo.Sparse)
    np.testing.assert_array_equal(apart.transform.sample().toarray(), few)
