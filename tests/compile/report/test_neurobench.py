import nengo
import numpy as np
import pytest

from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.compile.report.neurobench import NeuroBench, neurobench, workload


@pytest.fixture(scope="module")
def wired() -> Compilation:
    """Return two neurons wired to four; two of the eight weights are 0."""
    with nengo.Network(seed=1) as network:
        pre = nengo.Ensemble(2, 1, gain=np.ones(2), bias=np.ones(2), label="pre")
        post = nengo.Ensemble(4, 1, gain=np.ones(4), bias=np.ones(4), label="post")
        weights = [[1, 2], [1, 0], [0, 2], [1, 1]]
        nengo.Connection(pre.neurons, post.neurons, transform=weights, synapse=0.005)
    return compile_network(network)


def test_static_metrics_agree_with_a_count_by_hand(wired: Compilation) -> None:
    (bits,) = {sum(core.synapse_bits for core in wired.report.cores)}
    assert neurobench(wired.image, wired.report.cores) == NeuroBench(
        footprint_bytes=bits // 8 + 6 * 6,  # 24 bit each of current and voltage
        connection_sparsity=2 / 8,
        dense=8.0,
    )


def test_workload_metrics_agree_with_a_count_by_hand(wired: Compilation) -> None:
    activity = expected_activity(wired.image, Rates(0, {"pre": 500}))
    assert workload(activity) == {"effective_acs": pytest.approx(2 * 0.5 * 4), "effective_macs": 0}
