"""Built parameters of networks with radii and weight solvers, fresh and from the cache."""

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.backends.kept import KeptCompilation
from spikeport.cache import Cache

WEIGHTS = nengo.solvers.LstsqL2(weights=True)


def mixed() -> nengo.Network:
    """Return a network of ensembles on host and chip, wired in all ways that have parameters."""
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        node = nengo.Node(lambda t: 0.5)
        host = nengo.Ensemble(20, 1, radius=4.0)
        other = nengo.Ensemble(15, 1, radius=0.5, label="other")
        for one in (host, other):
            network.config[one].on_chip = False
        a, b = (
            nengo.Ensemble(n, 1, radius=2.0, label=label) for n, label in ((30, "a"), (25, "b"))
        )
        for pre, post in ((node, host), (host, a), (host, other), (a, b), (b, host)):
            nengo.Connection(pre, post)
        for pre, post in ((a, b), (a, b[[0]]), (host, other), (host, a)):
            nengo.Connection(pre, post, solver=WEIGHTS)
        nengo.Connection(a.neurons, b.neurons, transform=np.full((25, 30), 1e-4))
    return network


def parameters(cache: Cache, pipeline: str) -> tuple[bool, dict[str, list[np.ndarray]]]:
    """Return whether a compile was kept, and the arrays of all objects that have parameters."""
    network, found = mixed(), {}
    with spikeport.Simulator(network, cache=cache, pipeline=pipeline) as sim:
        for number, obj in enumerate((*network.all_ensembles, *network.all_connections)):
            try:
                built = sim.data[obj]
            except KeyError:  # passes replaced it, see `Simulator.data`
                continue
            arrays = {name: value for name, value in built._asdict().items() if name[0] != "_"}
            arrays.pop("solver_info", None)  # it has the time that a solve took
            found[f"{number} {obj}".split(" at 0x")[0]] = [
                np.asarray(value) for value in arrays.values() if value is not None
            ]
        return isinstance(sim.compilation, KeptCompilation), found


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_a_compile_from_the_cache_has_the_parameters_of_a_fresh_one(tmp_path, pipeline) -> None:
    cache = Cache(tmp_path / "cache")
    (first, fresh), (second, kept) = (parameters(cache, pipeline) for _ in range(2))
    assert (first, second) == (False, True)
    assert list(fresh) == list(kept)
    assert len(fresh) >= 10
    for name, values in fresh.items():
        for mine, wanted in zip(kept[name], values, strict=True):
            assert mine.shape == wanted.shape, name
            assert np.array_equal(mine, wanted), name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pipeline", "post", "shape"),
    [("as_written", "b", (25, 30)), ("compact", "other", (15, 20))],  # compact replaces a's to b
)
def test_a_compile_from_the_cache_has_nengos_encoders_and_shapes(
    tmp_path, pipeline, post, shape
) -> None:
    cache = Cache(tmp_path / "cache")
    parameters(cache, pipeline)
    network = mixed()
    sim = spikeport.Simulator(network, cache=cache, pipeline=pipeline)
    with sim, nengo.Simulator(network, progress_bar=False) as theirs:
        for ensemble in network.all_ensembles:
            wanted = theirs.data[ensemble].scaled_encoders
            np.testing.assert_allclose(sim.data[ensemble].scaled_encoders, wanted)
        full = [c for c in network.all_connections if c.solver is WEIGHTS]
        (one, *_) = (c for c in full if c.post_obj.label == post)
        assert sim.data[one].weights.shape == theirs.data[one].weights.shape == shape
