"""Steps that a probe records, and their values."""

import nengo
import numpy as np
import pytest

from spikeport.backends.sampling import is_sampled, recorded, sampled


def test_every_step_is_recorded_without_sample_every() -> None:
    assert sampled(3, None, 0.001).tolist() == [1, 2, 3]
    assert is_sampled(3, None, 0.001)


@pytest.mark.parametrize("sample_every", [0.001, 0.002, 0.0025, 0.003, 0.0101])
def test_steps_are_those_that_nengo_samples(sample_every: float) -> None:
    with nengo.Network() as network:
        node = nengo.Node(lambda t: round(1000 * t))
        probe = nengo.Probe(node, sample_every=sample_every)
    with nengo.Simulator(network, progress_bar=False) as simulator:
        simulator.run_steps(40)
        theirs = simulator.data[probe][:, 0].astype(int).tolist()
    assert sampled(40, sample_every, 0.001).tolist() == theirs
    assert [n for n in range(1, 41) if is_sampled(n, sample_every, 0.001)] == theirs


def test_data_of_a_probe_without_samples_have_the_shape_of_its_values() -> None:
    with nengo.Network() as network:
        node, target = nengo.Node(size_in=2), nengo.Node(size_in=3)
        learnt = nengo.Connection(node, target, transform=np.ones((3, 2)))
        probes = nengo.Probe(node, sample_every=0.005), nengo.Probe(learnt, "weights")
        probes[1].sample_every = 0.005
    with nengo.Simulator(network, progress_bar=False) as simulator:
        for n_steps, samples in (4, 0), (1, 1):
            simulator.run_steps(n_steps)
            shapes = [recorded(simulator, probe).shape for probe in probes]
            assert shapes == [(samples, 2), (samples, 3, 2)]
