"""Networks that hypothesis draws: their sizes, connections, filters and learning."""

from typing import Any, NamedTuple

import nengo
import numpy as np
from hypothesis import strategies as st

from tests.helpers.random_networks import KINDS

TAUS = (0, 0.002, 0.005, 0.02, 0.1)
WEIGHTS = nengo.solvers.LstsqL2(weights=True)


class Link(NamedTuple):
    """A connection: its kind, its ends by number, its filter, and the seed of its weights."""

    kind: str
    pre: int
    post: int
    tau: float
    seed: int


class Plan(NamedTuple):
    """A network before it is built."""

    sizes: tuple[int, ...]
    links: tuple[Link, ...]
    learning: bool

    @property
    def sends_spikes(self) -> bool:
        """True if spikes go straight to neurons, through filters that decoded values lack."""
        return any(one.kind in ("inhibition", "weights") and one.tau != 0.005 for one in self.links)


KINDS_OF_LINKS = (
    "values",
    "slice",
    "function",
    "array",
    "passthrough",
    "neurons",
    "inhibition",
    "weights",
)
NUMBERS = st.integers(0, 3)
LINKS = st.builds(
    Link, st.sampled_from(KINDS_OF_LINKS), NUMBERS, NUMBERS, st.sampled_from(TAUS), NUMBERS
)
PLANS = st.builds(
    Plan,
    st.tuples(*[st.integers(6, 14)] * 4),
    st.lists(LINKS, min_size=3, max_size=7).map(tuple),
    st.booleans(),
)


def built(plan: Plan) -> nengo.Network:
    """Build a plan: two ensembles, one in a subnetwork, an array, a node between, both ends."""
    with nengo.Network(seed=3, label="drawn") as network:
        network.config[nengo.Ensemble].intercepts = nengo.dists.Uniform(-1, 0.9)
        source = nengo.Node(lambda t: np.sin(20 * t + np.arange(2)), label="source")
        parts = [_ensemble(n, i) for i, n in enumerate(plan.sizes[:2])]
        with nengo.Network(label="inner"):
            parts.append(_ensemble(plan.sizes[2], 2))
        array = nengo.networks.EnsembleArray(plan.sizes[3], 2, neuron_type=KINDS[0], label="array")
        middle = nengo.Node(size_in=2, label="middle")
        output = nengo.Node(lambda _t, x: x, size_in=2, label="output")
        nengo.Connection(source, parts[0], synapse=0.005)
        nengo.Connection(source, array.input, synapse=None)
        nengo.Connection(middle, parts[2], synapse=None)
        for link in plan.links:
            _connect(link, parts, array, middle)
        for part in (*parts, array.output):
            nengo.Connection(part, output, synapse=0.01)
        nengo.Probe(output)
        nengo.Probe(parts[1], synapse=0.01)
        nengo.Probe(array.output, synapse=0.01)
        if plan.learning:
            _learn(parts[1], source)
    return network


def _ensemble(n: int, number: int) -> nengo.Ensemble:
    return nengo.Ensemble(n, 2, radius=1 + number / 4, neuron_type=KINDS[0], label=f"part {number}")


def _connect(
    link: Link,
    parts: list[nengo.Ensemble],
    array: nengo.networks.EnsembleArray,
    middle: nengo.Node,
) -> None:
    pre, post = parts[link.pre % 3], parts[link.post % 3]
    rng = np.random.RandomState(link.seed)
    square, row = rng.uniform(-0.5, 0.5, (2, 2)), rng.uniform(-0.5, 0.5, (1, 2))
    options: dict[str, Any] = {"transform": square, "synapse": link.tau}
    if link.kind == "values":
        nengo.Connection(pre, post, **options)
    elif link.kind == "slice":
        nengo.Connection(pre, post[link.seed % 2], **{**options, "transform": row})
    elif link.kind == "function":
        nengo.Connection(pre, post, function=np.square, **options)
    elif link.kind == "array":
        nengo.Connection(array.output, array.input, **options)
        nengo.Connection(array.output, post, **options)
    elif link.kind == "passthrough":
        nengo.Connection(pre, middle, **options)
    elif link.kind == "weights":
        nengo.Connection(pre, post, solver=WEIGHTS, **options)
    elif link.kind == "neurons":
        matrix = 1e-3 * rng.uniform(-1, 1, (2, pre.n_neurons))
        nengo.Connection(pre.neurons, post, transform=matrix, synapse=link.tau)
    else:
        matrix = -1e-3 * rng.uniform(0, 1, (post.n_neurons, pre.n_neurons))
        nengo.Connection(pre.neurons, post.neurons, transform=matrix, synapse=link.tau)


def _learn(stimulus: nengo.Ensemble, source: nengo.Node) -> None:
    with nengo.Network(label="school"):
        pupil = nengo.Ensemble(12, 1, neuron_type=KINDS[0], label="pupil")
        error = nengo.Node(size_in=1, label="error")
    nengo.Connection(source[0], pupil)
    learned = nengo.Connection(pupil, error, learning_rule_type=nengo.PES(1e-3))
    nengo.Connection(source[1], error, synapse=None)
    nengo.Connection(error, learned.learning_rule)
    nengo.Probe(error)
