"""Costs of the paths that decoded values can take, and the choice of a path."""

import nengo
import numpy as np
import pytest
import scipy.sparse as sparse
from nengo_loihi.neurons import LoihiSpikingRectifiedLinear

from spikeport.compile.loihi.relay import RELAYS
from spikeport.compile.rewriting.decode_paths import (
    OTHER_FILTER,
    SYNAPSE_BITS,
    PathCost,
    Slack,
    all_but,
    chosen,
    pareto,
    path_costs,
    rejected,
    relay_noise,
    rounding,
)
from spikeport.compile.rewriting.links import Link
from spikeport.hardware_models import chip as chips
from tests.helpers.small_networks import DT_S, LINK

LIMITS = chips.get("loihi").limits
RATE_HZ = 50.0


def test_dominated_costs_are_not_in_the_pareto_front() -> None:
    cheap, good = PathCost("a", 1, 1, 0, 0, 0.5), PathCost("b", 2, 1, 0, 0, 0.1)
    worse = PathCost("c", 2, 2, 0, 0, 0.2)
    assert pareto([cheap, good, worse]) == [cheap, good]


def test_equal_costs_do_not_dominate_each_other() -> None:
    a, b = PathCost("a", 1, 1, 0, 0, 0.5), PathCost("b", 1, 1, 0, 0, 0.5)
    assert pareto([a, b]) == [a, b]


def test_more_decode_neurons_make_less_noise() -> None:
    assert relay_noise("host", DT_S) < relay_noise("preset10", DT_S) < relay_noise("onoff", DT_S)


@pytest.mark.parametrize("path", ["onoff", "preset10"])
def test_noise_of_relays_equals_that_of_a_simulation_in_the_steady_state(path: str) -> None:
    values, relay = np.linspace(-0.9, 0.9, 37), RELAYS[path](dt=DT_S)
    signs = np.resize([1, -1], len(relay.gain))
    current = np.outer(values, signs * relay.gain) + relay.bias
    kind = LoihiSpikingRectifiedLinear(initial_state={"voltage": nengo.dists.Choice([0])})
    with nengo.Network() as network:
        neurons = nengo.Ensemble(
            current.size, 1, gain=np.ones(current.size), bias=current.ravel(), neuron_type=kind
        ).neurons
        probe = nengo.Probe(neurons, synapse=0.005)
    with nengo.Simulator(network, dt=DT_S, progress_bar=False) as sim:
        sim.run_steps(400)
    decoded = relay.scale * DT_S * (sim.data[probe][200:].reshape(200, *current.shape) @ signs)
    expected = np.sqrt(np.mean((decoded - values) ** 2))
    assert relay_noise(path, DT_S) == pytest.approx(expected, rel=1e-3)


def test_rounding_is_relative_to_the_largest_weight() -> None:
    assert rounding(sparse.csr_array([[127.0, 1.0, 0.0]])) == 0
    assert rounding(sparse.csr_array([[127.0, 0.4]])) == pytest.approx(0.4 / 127, rel=1e-4)
    assert rounding(sparse.csr_array((3, 2))) == 0


N_DISTINCT, N_DECODERS, N_ENCODERS = 3, 6, 4
N_DIRECT = (3 + 3 + 2, 5 + 5 + 2)
"""Numbers of weights E D that are not zero: of the three distinct neurons, and of all."""


def cost_of(path: str, of: Link = LINK) -> PathCost:
    (cost,) = (one for one in path_costs(of, 0.25, LIMITS, DT_S, RATE_HZ) if one.path == path)
    return cost


def share(**used: float) -> float:
    return max(amount / LIMITS.most(resource) for resource, amount in used.items())


def test_direct_wiring_takes_axons_and_weights() -> None:
    direct = cost_of("direct")
    bits = SYNAPSE_BITS * N_DIRECT[0]
    assert direct.cores == share(in_axons=N_DISTINCT, synapse_bits=bits)
    assert direct.synaptic_ops_per_s == RATE_HZ * sum(
        np.count_nonzero((LINK.encoders @ LINK.decoders).toarray(), axis=0)
    )
    assert (direct.host_messages_per_s, direct.delay_s) == (0, 0)


def test_the_error_of_direct_wiring_is_given() -> None:
    assert cost_of("direct").error == 0.25


@pytest.mark.parametrize(
    ("path", "pairs", "spikes_per_s"), [("onoff", 1, 1000), ("preset10", 10, 711.2)]
)
def test_relays_take_pairs_of_compartments_for_each_dimension(
    path: str, pairs: int, spikes_per_s: float
) -> None:
    relay = cost_of(path)
    bits = 2 * (pairs * 5 + N_ENCODERS) * SYNAPSE_BITS  # five distinct decoders are not zero
    assert relay.cores == share(
        compartments=2 * pairs * 2, in_axons=N_DISTINCT + 4, synapse_bits=bits
    )
    ops = 2 * pairs * RATE_HZ * N_DECODERS + spikes_per_s * N_ENCODERS
    assert relay.synaptic_ops_per_s == pytest.approx(ops, abs=0.5)
    assert relay.delay_s == pytest.approx(0.006)
    assert relay.error == pytest.approx(np.hypot(rounding(LINK.decoders), relay_noise(path, DT_S)))


@pytest.mark.parametrize(("path", "pairs"), [("onoff", 1), ("preset10", 10)])
def test_the_cores_of_relays_are_those_of_their_weights_if_these_take_most(
    path: str, pairs: int
) -> None:
    values = np.random.RandomState(0).uniform(1, 2, (20, 1000))
    dense = Link(sparse.csr_array(values), sparse.csr_array(values.T), gains=np.ones(1000))
    bits = 2 * (pairs + 1) * values.size * SYNAPSE_BITS
    assert cost_of(path, dense).cores == share(synapse_bits=bits)


def test_the_path_over_the_host_takes_messages_in_every_step() -> None:
    host = cost_of("host")
    assert host.host_messages_per_s == 2 * 2 / DT_S
    assert host.delay_s == pytest.approx(0.007)
    assert host.synaptic_ops_per_s == 2 * RATE_HZ * N_DECODERS + N_ENCODERS / DT_S
    bits = 2 * (N_DECODERS + N_ENCODERS) * SYNAPSE_BITS
    assert host.cores == share(compartments=4, in_axons=5 + 4, synapse_bits=bits)
    assert host.error == pytest.approx(np.hypot(rounding(LINK.decoders), relay_noise("host", DT_S)))


def test_every_path_has_a_cost() -> None:
    paths = [one.path for one in path_costs(LINK, 0.25, LIMITS, DT_S, RATE_HZ)]
    assert paths == ["direct", "onoff", "preset10", "host"]


def costs(**changes: dict[str, float]) -> list[PathCost]:
    """Return costs: direct wiring is large and exact; relays are slow, the host slower."""
    usual = [
        PathCost("direct", 3.0, 0, 0, 0.0, 0.01),
        PathCost("onoff", 0.5, 0, 0, 0.006, 0.3),
        PathCost("preset10", 1.0, 0, 0, 0.006, 0.1),
        PathCost("host", 0.5, 0, 1, 0.007, 0.05),
    ]
    return [one._replace(**changes.get(one.path, {})) for one in usual]


LESS_THAN_HOST = {"host": "1 ms slower than decode neurons"}


@pytest.mark.parametrize(
    ("slack", "not_direct", "reasons"),
    [
        (
            Slack(2.5, 0.0),
            "",
            {
                "onoff": "has a larger error than direct",
                "preset10": "has a larger error than direct",
            },
        ),
        (
            Slack(2.4, 0.0),
            "",
            {
                "direct": "2.5 more cores than the fewest",
                "onoff": "has a larger error than preset10",
            },
        ),
        (
            Slack(0.4, 0.0),
            "",
            {
                "direct": "2.5 more cores than the fewest",
                "preset10": "0.5 more cores than the fewest",
            },
        ),
        (
            Slack(2.5, 0.0),
            OTHER_FILTER,
            {"direct": OTHER_FILTER, "onoff": "has a larger error than preset10"},
        ),
        (
            Slack(0.4, 0.0),
            OTHER_FILTER,
            {"direct": OTHER_FILTER, "preset10": "0.5 more cores than the fewest"},
        ),
    ],
)
def test_the_path_with_the_least_error_of_the_small_and_fast_ones_is_chosen(
    slack: Slack, not_direct: str, reasons: dict[str, str]
) -> None:
    assert rejected(costs(), slack, not_direct) == LESS_THAN_HOST | reasons


def test_a_slower_path_is_chosen_if_its_delay_is_allowed() -> None:
    found = rejected(costs(), Slack(1.0, 0.001))
    assert chosen(costs(), found) == "host"
    assert chosen(costs(), rejected(costs(), Slack(1.0, 0.0009))) == "preset10"


def test_delays_that_differ_only_by_rounding_are_equal() -> None:
    relay_s = {"delay_s": 0.3}
    equal = costs(host={"delay_s": 0.1 + 0.2}, onoff=relay_s, preset10=relay_s)
    assert chosen(equal, rejected(equal, Slack(1.0, 0.0))) == "host"


def test_a_path_that_is_too_slow_does_not_count_for_the_fewest_cores() -> None:
    small_host = costs(host={"cores": 0.0}, onoff={"cores": 2.0}, preset10={"cores": 2.0})
    assert chosen(small_host, rejected(small_host, Slack(1.0, 0.0))) == "direct"


def test_a_path_that_is_set_rejects_all_others() -> None:
    reasons = all_but("onoff", costs())
    assert reasons == dict.fromkeys(("direct", "preset10", "host"), "onoff is set")
    assert chosen(costs(), reasons) == "onoff"
