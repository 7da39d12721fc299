"""Nengo's own simulator of a network as the passes leave it."""

import nengo
import numpy as np
import pytest

from spikeport.backends.float_simulator import float_simulator
from spikeport.compile.ground.refusal import RefusedError
from tests.helpers.small_networks import DT_S, rewrite_of


@pytest.mark.parametrize("optimize", [True, False])
def test_a_float_simulator_computes_what_nengo_computes(optimize: bool) -> None:
    with nengo.Network(seed=3) as network:
        a = nengo.Ensemble(30, 1)
        nengo.Connection(nengo.Node(0.5), a)
        probe = nengo.Probe(a, synapse=0.01)
    data = []
    for sim in (
        float_simulator(rewrite_of(network), DT_S, 0, optimize),
        nengo.Simulator(network, dt=DT_S, progress_bar=False),
    ):
        with sim:
            sim.run_steps(50)
            data.append(sim.data[probe])
    np.testing.assert_allclose(*data, atol=1e-12)
    assert np.abs(data[0]).max() > 0


def test_a_loop_that_nengo_refuses_is_refused() -> None:
    with nengo.Network(seed=3) as network:
        a = nengo.Ensemble(5, 1, label="a")
        nengo.Connection(a, a, synapse=None)
    with pytest.raises(RefusedError, match="Input graph has cycles"):
        float_simulator(rewrite_of(network), DT_S, 0, optimize=True)
