"""Steps that a probe records."""

import nengo
import pytest

from spikeport.backends.sampling import sampled


def test_every_step_is_recorded_where_nothing_else_is_asked_for() -> None:
    assert sampled(3, None, 0.001).tolist() == [1, 2, 3]


@pytest.mark.parametrize("sample_every", [0.001, 0.002, 0.0025, 0.003, 0.0101])
def test_steps_are_those_that_nengo_samples(sample_every: float) -> None:
    with nengo.Network() as network:
        node = nengo.Node(lambda t: round(1000 * t))
        probe = nengo.Probe(node, sample_every=sample_every)
    with nengo.Simulator(network, progress_bar=False) as simulator:
        simulator.run_steps(40)
        theirs = simulator.data[probe][:, 0].astype(int).tolist()
    assert sampled(40, sample_every, 0.001).tolist() == theirs
