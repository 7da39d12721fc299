from collections import Counter

import nengo
import numpy as np
import pytest

from spikeport.networks.arm import MAX_DECODED_NEURONS, PRESETS, ArmSizes, arm, term_torques
from spikeport.networks.solvers import PerDimension

SMALL = ArmSizes(m1=40, cb=30, s1=10)


def held(law, region, seed=0, sizes=None, **options):
    """Return a function that holds a state at a controller's input, and returns its torques."""
    shown = np.zeros(14)
    with nengo.Network(seed=seed) as net:
        controller = arm(law, region, sizes, seed=seed, **options)
        plant = nengo.Node(lambda _t: shown, size_out=14)
        nengo.Connection(plant[:11], controller.state, synapse=None)
        nengo.Connection(plant[11:], controller.target, synapse=None)
        probe = nengo.Probe(controller.torque)
    sim = nengo.Simulator(net, progress_bar=False, optimize=False)

    def hold(q, dq, error, seconds=0.2):
        hand = law.arm.at(q).position
        shown[:] = [*q, *dq, *hand, *(hand + error)]
        sim.run(seconds)
        return sim.data[probe]

    return hold


def full_scale(law, region):
    """Return the sum (4,) of the largest torques of all terms for each joint, in N m."""
    terms = law.terms(region.q_samples)
    parts = [
        *(np.abs(terms.kinematic).max(axis=0) * region.error.half[:, np.newaxis]),
        *(np.abs(terms.damping).max(axis=0) * region.dq.half[:, np.newaxis]),
        np.abs(terms.bias).max(axis=0),
    ]
    return np.sum(parts, axis=0)


def of_label(net, label):
    return [e for e in net.all_ensembles if e.label.startswith(label)]


# structure


@pytest.mark.slow
def test_the_network_has_the_ensembles_of_the_paper(law, region):
    net = arm(law, region)
    assert {e.label: (e.n_neurons, e.dimensions) for e in net.all_ensembles} == {
        "S1": (11 * 50, 11),
        "M1 x": (1000, 5),
        "M1 y": (1000, 5),
        "M1 z": (1000, 5),
        "CB pitch": (200, 5),
        "CB roll": (200, 5),
        "CB yaw": (200, 5),
        "CB elbow": (200, 5),
        "CB gravity": (200, 4),
    }
    assert (net.state.size_in, net.target.size_in, net.torque.size_out) == (11, 3, 4)


@pytest.mark.parametrize(("preset", "total"), [("paper", 25_550), ("lean", 4_550)])
def test_the_presets_have_their_totals_of_neurons(law, region, preset, total):
    assert PRESETS[preset].total == total
    assert sum(e.n_neurons for e in arm(law, region, PRESETS[preset]).all_ensembles) == total


@pytest.mark.parametrize("n", [50, 7])
def test_intercepts_of_s1_are_evenly_spaced_in_pairs_of_opposite_signs(law, region, n):
    (s1,) = of_label(arm(law, region, ArmSizes(m1=40, cb=30, s1=n)), "S1")
    intercepts = np.reshape(s1.intercepts, (11, n))
    signs = np.asarray(s1.encoders).sum(axis=1).reshape(11, n)
    assert (intercepts == intercepts[0]).all()
    assert np.diff(intercepts[0, ::2]) == pytest.approx(1.9 / -(-n // 2))
    assert (intercepts[:, 1::2] == intercepts[:, : n - 1 : 2]).all()
    assert (signs[:, 1::2] == -signs[:, : n - 1 : 2]).all()


def test_the_terms_add_up_to_the_torque(law, region):
    q, rng = region.q_samples[:5], np.random.RandomState(0)
    dq, error = rng.randn(5, 4), 0.1 * rng.randn(5, 3)
    terms = term_torques(law.terms(q), dq, error)
    assert list(terms) == list(arm(law, region, SMALL).groups)
    assert sum(terms.values()) == pytest.approx(law.torques(q, dq, error))


def decoded(net):
    """Return the connections that decode a term of the torque."""
    terms = [ensemble for group in net.groups.values() for ensemble in group]
    return [c for c in net.all_connections if c.pre_obj in terms]


def test_decoders_passed_in_are_split_among_the_ensembles_of_a_group(law, region):
    sizes = ArmSizes(m1=MAX_DECODED_NEURONS + 2, cb=30, s1=10)
    given = np.random.RandomState(0).randn(sizes.m1, 4)
    net = arm(law, region, sizes, decoders={"M1 x": given})
    solvers = {c.pre_obj: c.solver for c in decoded(net)}
    taken = np.vstack([solvers[ensemble].values for ensemble in net.groups["M1 x"]])
    assert taken * (given[0] / taken[0]) == pytest.approx(given)
    assert isinstance(solvers[net.groups["M1 y"][0]], nengo.solvers.LstsqL2)


def test_s1_has_fifty_neurons_for_each_dimension_that_encode_it_alone(law, region):
    (s1,) = of_label(arm(law, region), "S1")
    encoders = np.asarray(s1.encoders)
    assert (np.count_nonzero(encoders, axis=1) == 1).all()
    assert (np.count_nonzero(encoders, axis=0) == 50).all()
    assert [np.flatnonzero(encoders[:, d])[0] for d in range(11)] == [50 * d for d in range(11)]
    assert set(np.unique(encoders)) == {-1.0, 0.0, 1.0}


@pytest.mark.parametrize("m1", [4001, 8000, 8002, 12_001])
def test_large_ensembles_are_split_without_losing_neurons(law, region, m1):
    sizes = ArmSizes(m1=m1, cb=30, s1=10)
    net = arm(law, region, sizes)
    parts = of_label(net, "M1 x")
    assert len(parts) == -(-m1 // MAX_DECODED_NEURONS)
    assert max(e.n_neurons for e in parts) <= MAX_DECODED_NEURONS
    assert sum(e.n_neurons for e in net.all_ensembles) == sizes.total


@pytest.mark.slow
def test_the_parts_of_a_split_ensemble_share_its_targets(law, region):
    def targets(m1):
        net = arm(law, region, ArmSizes(m1=m1, cb=30, s1=10))
        return [
            (c.function_info.size, np.asarray(c.function))
            for e in of_label(net, "M1 x")
            for c in net.all_connections
            if c.pre_obj is e
        ]

    ((_, whole),) = targets(4000)
    parts = targets(8000)
    assert len(parts) == 2
    for _, part in parts:
        assert part == pytest.approx(whole / 2)


def test_decoded_values_are_scaled_to_at_most_one(law, region):
    net = arm(law, region, SMALL)
    connections = decoded(net)
    assert len(connections) == 8
    for connection in connections:
        assert np.abs(connection.function).max(axis=0) == pytest.approx(1.0)


def test_s1_drives_each_of_its_targets_once(law, region):
    net = arm(law, region, SMALL)
    (s1,) = of_label(net, "S1")
    driven = Counter(c.post_obj.label for c in net.all_connections if c.pre_obj is s1)
    assert set(driven.values()) == {1}
    assert len(driven) == 8


def test_each_m1_axis_has_a_probe_of_its_spikes(law, region):
    net = arm(law, region)
    assert {axis: probe.size_in for axis, probe in net.rasters.items()} == dict.fromkeys("xyz", 60)


def test_one_neuron_of_each_kind_is_enough_to_build(law, region):
    net = arm(law, region, ArmSizes(m1=1, cb=1, s1=1))
    assert sum(e.n_neurons for e in net.all_ensembles) == 19


# the efference copy


def test_with_an_efference_copy_cb_has_neurons_that_learn(law, region):
    without, net = (arm(law, region, SMALL, efference_copy=copy) for copy in (False, True))
    (learned,) = of_label(net, "CB learned")
    assert (learned.n_neurons, learned.dimensions) == (SMALL.cb, 8)
    (decoded_,) = (c for c in net.all_connections if c.learning_rule is not None)
    assert decoded_.pre_obj is learned
    assert not np.any(decoded_.function(np.ones(8)))
    # Everything else is the same as in the network without it.
    names = [e.label for e in without.all_ensembles]
    assert [e.label for e in net.all_ensembles if e is not learned] == names


@pytest.mark.slow
def test_cb_learns_to_add_the_torque_that_m1_keeps_asking_for(law, region):
    q, error, still = region.q.restore(np.zeros(4)), 0.8 * region.error.half, np.zeros(4)
    with_copy, without = (held(law, region, sizes=SMALL, efference_copy=c) for c in (True, False))
    learned, plain = with_copy(q, still, error, 1.0), without(q, still, error, 1.0)
    begin, end = (
        np.mean((learned - plain)[part], axis=0) for part in (slice(50), slice(-200, None))
    )
    asked = plain[-200:].mean(axis=0) - without(q, still, np.zeros(3), 0.3)[-200:].mean(axis=0)
    assert np.abs(begin).max() < 0.1 * np.abs(end).max()
    assert end @ asked > 0.95 * np.linalg.norm(end) * np.linalg.norm(asked)


# decoders


def shared_and_separate(n=30, dimensions=4):
    """Return decoders of an ensemble by PerDimension, and of an ensemble for each dimension."""
    rng = np.random.RandomState(2)
    total = n * dimensions
    encoders = np.repeat(np.eye(dimensions), n, axis=0)
    encoders *= np.where(np.arange(total) % 2, 1.0, -1.0)[:, np.newaxis]
    points = rng.uniform(-1, 1, (400, dimensions))
    gain, bias = rng.uniform(1, 3, total), rng.uniform(0, 4, total)
    with nengo.Network(seed=1) as net:
        out = nengo.Node(size_in=dimensions)
        shared = nengo.Ensemble(
            total, dimensions, encoders=encoders, gain=gain, bias=bias, eval_points=points
        )
        wire = nengo.Connection(shared, out, solver=PerDimension(n))
        wires = []
        for d in range(dimensions):
            mine = slice(d * n, (d + 1) * n)
            one = nengo.Ensemble(
                n, 1, encoders=encoders[mine, d : d + 1], gain=gain[mine], bias=bias[mine],
                eval_points=points[:, d : d + 1],
            )  # fmt: skip
            solver = nengo.solvers.LstsqL2(reg=0.05)
            wires.append(nengo.Connection(one, out[d], solver=solver))
    with nengo.Simulator(net, progress_bar=False) as sim:
        return sim.data[wire].weights, [sim.data[w].weights for w in wires]


def test_shared_decoders_are_zero_outside_their_own_neurons():
    decoders, _ = shared_and_separate()
    own = np.repeat(np.eye(4, dtype=bool), 30, axis=1)
    assert (decoders[~own] == 0).all()
    assert (np.abs(decoders[own]) > 0).mean() > 0.9


def test_shared_decoders_are_those_of_separate_ensembles():
    decoders, separate = shared_and_separate()
    for d, weights in enumerate(separate):
        assert decoders[d, 30 * d : 30 * (d + 1)] == pytest.approx(weights[0], rel=1e-9, abs=1e-15)


def test_s1s_decoders_are_per_dimension(law, region):
    net = arm(law, region, SMALL)
    (s1,) = of_label(net, "S1")
    outgoing = [c for c in net.all_connections if c.pre_obj is s1]
    assert {(type(c.solver), c.solver.n_neurons) for c in outgoing} == {(PerDimension, SMALL.s1)}


# computed torques


def states_inside(law, region, n):
    """Return joint angles, velocities and errors whose hand and target lie in the region too."""
    rng = np.random.RandomState(5)
    found = []
    while len(found) < n:
        q = region.q_samples[rng.randint(len(region.q_samples))]
        hand, target = law.arm.at(q).position, region.x.restore(rng.uniform(-0.9, 0.9, 3))
        inside = np.abs(region.x.normalise(hand)).max() < 1
        if inside and (np.abs(target - hand) < region.error.half).all():
            found.append((q, rng.uniform(-0.9, 0.9, 4) * region.dq.half, target - hand))
    return found


@pytest.mark.slow
def test_static_torques_are_those_of_the_exact_law(law, region):
    """Within 1.5 % of full scale (rms over states), and 4 % at every state.

    Regularised decoders of a few hundred spiking neurons leave about 1 to 3 % of each term's range;
    eight terms of independent error add up to less than that share of the sum of their ranges.
    Measured when written: 0.7 % and 2.0 %. Any one term left out costs at least 3.9 % rms.
    """
    hold, errors = held(law, region), []
    for q, dq, error in states_inside(law, region, 10):
        mean = hold(q, dq, error)[-100:].mean(axis=0)
        errors.append((mean - law.torque(q, dq, error)) / full_scale(law, region))
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 0.015
    assert np.abs(errors).max() < 0.04


def test_states_outside_the_region_are_clipped_to_it(law, region):
    nodes = arm(law, region, SMALL).all_nodes
    (normalised,) = [node for node in nodes if node.label == "normalised"]
    values = normalised.output(0.0, np.repeat([1e6, -1e6], [11, 3]))
    assert values.tolist() == [1.0] * 11 + [-1.0] * 3


@pytest.mark.slow
def test_the_same_seed_gives_the_same_torques_and_another_does_not(law, region):
    q, dq, error = region.q_samples[0], np.zeros(4), np.full(3, 0.05)

    def torques(seed):
        return held(law, region, seed, SMALL)(q, dq, error, seconds=0.05)

    first = torques(3)
    assert np.array_equal(first, torques(3))
    assert not np.array_equal(first, torques(4))
