"""Probes of connections on the host, which record the same as in float Nengo."""

import nengo
import numpy as np
import pytest
from nengo_loihi.splitter import HostChipSplit

from spikeport import Simulator
from spikeport.compile.loihi.host_probes import connections_probed_on_host


@pytest.mark.parametrize("passes", ["as_written", "compact"])
def test_learned_weights_and_errors_on_the_host_are_recorded_as_in_float(passes: str) -> None:
    with nengo.Network(seed=1) as network:
        pre = nengo.Ensemble(10, 1, neuron_type=nengo.RectifiedLinear())
        target, chip = nengo.Node(size_in=1), nengo.Ensemble(10, 1)
        learned = nengo.Connection(pre, target, learning_rule_type=nengo.PES(1e-2))
        nengo.Connection(nengo.Node(1.0), learned.learning_rule, synapse=None)
        weights = nengo.Probe(learned, "weights")
        error = nengo.Probe(learned.learning_rule, "error")
        nengo.Probe(target)
        spikes = nengo.Probe(chip.neurons)
    with (
        Simulator(network, pipeline=passes, offload=True) as sim,
        Simulator(network, backend="reference") as reference,
    ):
        for one in (sim, reference):
            one.run_steps(20)
        for probe in (weights, error):
            assert np.array_equal(sim.data[probe], reference.data[probe])
        assert np.ptp(sim.data[weights], axis=0).max() > 0
        assert sim.data[spikes].shape == (20, 10)


def test_nengo_loihis_placing_of_probes_is_restored_after_the_context() -> None:
    usual = HostChipSplit._place_probes
    with connections_probed_on_host():
        assert HostChipSplit._place_probes is not usual
    assert HostChipSplit._place_probes is usual
