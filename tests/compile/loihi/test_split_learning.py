"""Connections that learn and are too large for a core."""

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.split_learning import split_learning
from spikeport.compile.pipeline import compile_network


def learning(n_neurons: int, n_values: int) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        pre = nengo.Ensemble(n_neurons, 1, label="pre")
        out = nengo.Node(size_in=n_values, label="out")
        zeros = np.zeros(n_values)
        connection = nengo.Connection(
            pre, out, function=lambda x: zeros, learning_rule_type=nengo.PES()
        )
        nengo.Connection(out, connection.learning_rule)
        kept = nengo.Ensemble(10, 1, label="kept")
        nengo.Connection(nengo.Node(0.5), kept)
    return network


@pytest.mark.parametrize(
    ("n_neurons", "n_values", "n_cores"), [(10, 512, 1), (10, 513, 2), (600, 110, 2)]
)
def test_learning_weights_that_need_several_cores_are_refused(
    n_neurons: int, n_values: int, n_cores: int
) -> None:
    network = learning(n_neurons, n_values)
    found = list(split_learning(build(Rewrite(network, Names(network)), dt_s=0.001)))
    used = f"{n_neurons} neurons decode {n_values} values, on {n_cores} cores"
    assert [one.used for one in found] == ([used] if n_cores > 1 else [])


def test_the_ensemble_before_learning_weights_that_do_not_fit_is_offloaded() -> None:
    network = learning(10, 513)
    with pytest.raises(DoesNotFitError, match=r"pre -> out: SP012 learning on several cores"):
        compile_network(network)
    with Simulator(network, offload=True) as simulator:
        simulator.run_steps(2)
        assert simulator.compilation is not None
        (moved,) = simulator.compilation.report.offloaded
        assert (moved.object, moved.id) == ("pre", "SP012")
