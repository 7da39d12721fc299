"""Learning on the native backend: weights, traces and the random stream against nengo-loihi's."""

import itertools
from collections.abc import Iterator
from dataclasses import replace

import nengo
import numpy as np
import pytest

from spikeport import compile_network
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.native.learning import Rule, mark_arrivals, update_traces, update_weights
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.oracle import Oracle
from tests.helpers.side_by_side import assert_equal_activity, random_spikes, snapshot

pytestmark = pytest.mark.filterwarnings(
    "ignore:Received PES error", "ignore:Clipping", "ignore:Synaptic trace"
)

N_STEPS = 200
RULE = (1, 4, -7, 10, 8.5, 2, 4)
"""On, rate 4 2^-7, traces of 10 steps raised by 8.5, updated every 2 steps, weights every 4."""


@pytest.fixture(scope="module")
def pes() -> ChipImage:
    """Return an image of a communication channel that two errors teach."""
    with nengo.Network(seed=3) as net:
        stimulus = nengo.Node(lambda t: np.sin(9 * t), size_out=1)
        target = nengo.Node(lambda t: np.cos(9 * t), size_out=1)
        pre = nengo.Ensemble(60, 1, label="pre")
        post = nengo.Node(lambda t, x: x, size_in=1)
        other = nengo.Node(lambda t, x: x, size_in=2)
        error = nengo.Node(lambda t, x: x, size_in=1)
        nengo.Connection(stimulus, pre)
        taught = nengo.Connection(pre, post, learning_rule_type=nengo.PES(1e-3))
        pair = nengo.Connection(
            pre, other, function=lambda x: [x[0], -x[0]], learning_rule_type=nengo.PES(2e-3)
        )
        nengo.Connection(target, error, transform=-1)
        nengo.Connection(error, taught.learning_rule)
        nengo.Connection(error, pair.learning_rule, transform=[[1], [1]])
        nengo.Probe(post)
    return compile_network(net).image


def with_noise(image: ChipImage) -> ChipImage:
    return replace(
        image,
        compartments=replace(
            image.compartments, enable_noise=np.arange(image.n_compartments) % 3 > 0
        ),
        blocks=replace(image.blocks, noise_exp=np.full(image.n_blocks, 12)),
    )


def learning_groups(image: ChipImage) -> np.ndarray:
    return np.flatnonzero(image.groups.learning[:, 0])


def random_errors(image: ChipImage) -> Iterator[dict[int, np.ndarray]]:
    """Draw errors of every group that learns: rounded to zero, clipped, or none."""
    rng = np.random.RandomState(8)
    sizes = np.diff(image.blocks.start)[image.groups.block] // 2
    while True:
        scale = rng.choice([0.001, 0.3, 3])
        groups = learning_groups(image) if rng.rand() > 0.1 else []
        yield {int(g): rng.normal(scale=scale, size=sizes[g]) for g in groups}


def assert_learns_equally(image: ChipImage) -> NativeChip:
    native, theirs = NativeChip(image, 11), NengoLoihiChip(image, 11)
    spikes = random_spikes(image, N_STEPS, 2)
    for step, (sources, errors) in enumerate(zip(spikes, random_errors(image), strict=False)):
        ours, others = native.step(sources, errors), theirs.step(sources, errors)
        pairs = [(snapshot(native), snapshot(theirs)), (ours, others)]
        for a, b in itertools.chain.from_iterable(zip(*p, strict=True) for p in pairs):
            np.testing.assert_array_equal(a, b, err_msg=f"step {step + 1}")
        _assert_equal_learning(image, native, theirs)
    assert_equal_activity(native, theirs)
    return native


def _assert_equal_learning(image: ChipImage, native: NativeChip, theirs: NengoLoihiChip) -> None:
    learning, emulator = native._learning, theirs._emulator
    for group in learning_groups(image):
        ours, other = learning.groups[group], theirs._synapses[group]
        np.testing.assert_array_equal(ours.weights, np.concatenate(other.weights))
        np.testing.assert_array_equal(ours.traces, emulator.synapses.traces[other])
    for a, b in zip(learning._rng.get_state(), emulator.rng.get_state(), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [False, True])
def test_a_compiled_network_learns_as_on_nengo_loihi(pes: ChipImage, noise: bool) -> None:
    assert len(learning_groups(pes)) == 2
    native = assert_learns_equally(with_noise(pes) if noise else pes)
    assert native.activity().learning_updates.sum() > 0
    assert native.state.spike_count.sum() > 500
    assert np.any(native._wiring.weights != pes.synapses.weight)


@pytest.mark.parametrize("indices", [[0, 1, 2, 3], [3, 1, 0, 2], [0, 2, 2, 1]])
def test_learned_weights_reach_their_synapses_in_any_order(indices: list[int]) -> None:
    """Other rows of the image have duplicate indices, which hide a synapse."""
    image = Parts(
        blocks=[Block(n=4, vth=2**16, vmin=-(2**16)), Block(n=4, core=1, bias=900, vth=2000)],
        groups=[
            Group(weights=[[64, 128, 192], [0, 64, 128]], indices=[[0, 0, 1], [1, 2, 1]], block=1),
            Group(weights=[[0] * 4] * 5, indices=[[indices]] * 5, learning=RULE),
            Group(weights=[[640, 0, 0, 320]], block=1),
        ],
        inputs=[5],
        routes=[
            Route(axon=[0, 1, 0, 1, -1], input=0),
            Route(axon=[0, 1, 2, 3, 4], input=0, group=1),
            Route(axon=[4, 3, 2, 1], block=1, group=1),
            Route(axon=[0, 0, 0, 0], block=0, group=2),
        ],
    ).image()
    native = assert_learns_equally(image)
    assert native.state.spike_count[:4].any()
    assert native.state.spike_count[4:].all()


def test_the_oracle_does_not_learn(pes: ChipImage) -> None:
    with pytest.raises(NotImplementedError, match="the oracle does not learn"):
        Oracle(pes, 0)


@pytest.mark.parametrize("error", [200.0, 1e9, -1e9])
def test_an_error_beyond_the_chips_integers_is_warned_of_and_learned_as_on_nengo_loihi(
    error: float,
) -> None:
    group = Group([[64, 64]], learning=RULE)
    image = Parts([Block(2)], [group], [1], [Route([0], input=0)]).image()
    native, theirs = NativeChip(image, 0), NengoLoihiChip(image, 0)
    spike, errors = np.array([0]), {0: np.array([error])}
    for chip in (native, theirs):
        for _ in range(RULE[-1] - 1):
            chip.step(spike, errors)
        with pytest.warns(UserWarning, match="Received PES error"):
            chip.step(spike, errors)
    assert (native._learning.groups[0].weights != 64).any()
    _assert_equal_learning(image, native, theirs)
    theirs.close()


def test_a_second_spike_of_a_trace_before_its_update_is_lost() -> None:
    trace_of, raised = np.array([-1, 0, 1], np.int32), np.zeros(2, dtype=bool)
    arrivals = [0, 1], [0, 2], [1]
    lost = [mark_arrivals(np.array(one, np.int32), trace_of, raised) for one in arrivals]
    assert lost == [False, False, True]
    assert raised.all()


@pytest.mark.parametrize(("before", "clipped"), [(117, False), (118, True)])
def test_a_trace_is_clipped_beyond_127(before: int, clipped: bool) -> None:
    traces, raised = np.array([before, 50], np.int32), np.array([True, False])
    assert update_traces(traces, raised, 1.0, 10.0, np.zeros(2)) == clipped
    assert traces.tolist() == [127, 50]
    assert not raised.any()


@pytest.mark.parametrize(
    ("error", "after", "clipped"),
    [(2, 10, False), (3, 10, True), (-18, -10, False), (-19, -10, True)],
)
def test_a_learned_weight_is_clipped_at_its_largest_size(
    error: int, after: int, clipped: bool
) -> None:
    rule = Rule(rate=1, product_shift=0, weight_shift=0, scale=1.0, most=10, unit_shift=0)
    weights, trace = np.array([[8]], np.int32), np.array([1], np.int32)
    assert update_weights(weights, trace, np.array([error], np.int32), rule, np.zeros(1)) == clipped
    assert weights.tolist() == [[after]]
