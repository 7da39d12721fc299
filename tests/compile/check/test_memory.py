"""Estimates of the memory of a compile; `benchmarks/growth.py` measures their accuracy."""

import itertools
import math
from pathlib import Path

import nengo
import numpy as np
import pytest
import scipy.sparse

from spikeport.compile.check import memory
from spikeport.compile.check.memory import VARIABLE, available, estimate, over_memory
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.pipeline import compile_network
from spikeport.errors import UsageError


def chain(n: int, size: int = 5) -> nengo.Network:
    with nengo.Network(seed=0) as network:
        ensembles = [nengo.Ensemble(size, 1) for _ in range(n)]
        for pre, post in itertools.pairwise(ensembles):
            nengo.Connection(pre, post)
    return network


def wired(transform: object, n: int = 300) -> nengo.Network:
    with nengo.Network(seed=0) as network:
        pre, post = (nengo.Ensemble(n, 1) for _ in "ab")
        nengo.Connection(pre.neurons, post.neurons, transform=transform)
    return network


def test_the_estimate_grows_linearly_with_the_length_of_a_chain() -> None:
    first, second, third = (estimate(chain(n)) for n in (100, 200, 300))
    assert third - second == pytest.approx(second - first, rel=1e-3)
    assert 50_000 * 100 < second - first < 120_000 * 100


def test_weights_take_150_bytes_each() -> None:
    each = estimate(wired(1.0))
    assert estimate(wired(np.ones((300, 300)))) - each == 150 * (300 * 300 - 300)


def test_weights_of_sparse_matrices_take_700_bytes_each() -> None:
    def of(places: list[tuple[int, int]], init: object) -> int:
        return estimate(wired(nengo.Sparse((300, 300), indices=places, init=init)))

    one = of([(0, 0)], 1)
    diagonal = [(i, i) for i in range(300)]
    assert of(diagonal, 1) - one == of(diagonal, np.ones(300)) - one == 700 * 299
    assert estimate(wired(nengo.Sparse((300, 300), init=scipy.sparse.eye(300)))) - one == 700 * 299


def test_probes_take_20_000_bytes_each() -> None:
    network = chain(2)
    without = estimate(network)
    with network:
        for ensemble in network.ensembles:
            nengo.Probe(ensemble)
    assert estimate(network) - without == 2 * 20_000


def test_many_inputs_of_a_large_ensemble_take_little_memory_each() -> None:
    def with_inputs(n: int) -> int:
        with nengo.Network() as network:
            ensemble = nengo.Ensemble(2000, 1)
            for _ in range(n):
                nengo.Connection(nengo.Node([0.0]), ensemble)
        return estimate(network)

    assert with_inputs(500) - with_inputs(0) == pytest.approx(45e6, rel=0.5)  # the growth observed


def test_copies_of_a_convolutions_kernel_are_counted() -> None:
    def of_size(side: int) -> int:
        transform = nengo.Convolution(4, (side, side, 1), kernel_size=(3, 3))
        with nengo.Network() as network:
            pre, post = (nengo.Ensemble(n, 1) for n in (side * side, transform.size_out))
            nengo.Connection(pre.neurons, post.neurons, transform=transform)
        return estimate(network)

    weights, neurons = 4 * (38 * 38 - 18 * 18), 40 * 40 - 20 * 20
    more = 150 * 36 * weights / 128 + 400 * (weights + neurons)
    assert of_size(40) - of_size(20) == pytest.approx(more, abs=2)


def test_memory_to_solve_decoders_grows_with_the_square_of_the_neurons() -> None:
    sizes = [estimate(chain(2, n)) for n in (4000, 8000)]
    assert sizes[1] / sizes[0] == pytest.approx(4, rel=0.05)
    assert sizes[1] == pytest.approx(4.7e9, rel=0.1)  # observed: 4.7 GB
    network = chain(2, 8000)
    network.ensembles[0].n_eval_points = 500
    assert estimate(network) < 0.1 * sizes[1]
    network.ensembles[0].eval_points = np.zeros((250, 1))
    assert estimate(network) < 0.06 * sizes[1]


def test_memory_to_solve_the_decoders_of_a_probe_is_counted() -> None:
    with nengo.Network() as network:
        ensemble = nengo.Ensemble(1500, 1)
        nengo.Probe(ensemble.neurons)
    before = estimate(network)
    with network:
        nengo.Probe(ensemble)
    grown = 85e6  # observed
    assert grown < estimate(network) - before < 2 * grown


def test_evaluation_points_of_a_connection_itself_are_counted() -> None:
    with nengo.Network() as network:
        pre, post = nengo.Ensemble(100, 1), nengo.Ensemble(5, 1)
        own = nengo.Connection(pre, post, eval_points=np.zeros((60_000, 1)))
    assert estimate(network) == pytest.approx(52e6, rel=0.5)  # the growth observed
    own.eval_points = nengo.dists.Uniform(-1, 1)
    drawn = estimate(network)
    own.eval_points = None
    assert estimate(network) == drawn


def test_a_network_that_takes_more_memory_than_available_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    network = chain(100)
    monkeypatch.setenv(VARIABLE, str(1.01 * estimate(network) / 1e9))
    assert over_memory(network) == []
    monkeypatch.setenv(VARIABLE, "0.5")
    with pytest.raises(DoesNotFitError) as raised:
        compile_network(chain(2, 8000), pipeline="")
    assert str(raised.value) == (
        "the network does not fit chip 'loihi':\n"
        "  network: SP501 memory: 4.6 GB, limit 0.5 GB; cure: compile it on a machine with 5 GB "
        "to spare, or in parts: fewer ensembles and connections, smaller ones, or fewer evaluation "
        "points\nmore: spikeport compile --explain SP501"
    )


@pytest.mark.parametrize("text", ["much", "0", "-1", "nan", "inf"])
def test_a_memory_limit_that_is_not_a_positive_number_is_refused(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(UsageError) as raised:
        available()
    assert str(raised.value) == (
        f"SPIKEPORT_MEMORY_GB={text}: not a number of GB above 0; cure: SPIKEPORT_MEMORY_GB=8"
    )


def test_a_containers_limit_lowers_the_available_memory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(memory, "CGROUP", tmp_path)
    assert available() > 1e6
    (tmp_path / "memory.max").write_text("3000\n", encoding="utf-8")
    (tmp_path / "memory.current").write_text("1000\n", encoding="utf-8")
    assert available() == 2000
    (tmp_path / "memory.stat").write_text("file 900\ninactive_file 600\n", encoding="utf-8")
    assert available() == 2600
    (tmp_path / "memory.max").write_text("max\n", encoding="utf-8")
    assert available() > 1e6


def test_memory_is_unlimited_if_the_system_gives_no_figures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(memory, "_text", lambda path: "")
    assert available() == math.inf


def test_random_matrices_count_as_full_ones_and_transposed_convolutions_by_their_kernels() -> None:
    assert estimate(wired(nengo.dists.Gaussian(0, 1))) == estimate(wired(np.ones((300, 300))))

    def transposed(init: object) -> int:
        transform = nengo.transforms.ConvolutionTranspose(
            1, (64, 64, 1), kernel_size=(2, 2), strides=(2, 2), init=init
        )
        with nengo.Network() as network:
            pre, post = (nengo.Ensemble(n, 1) for n in (transform.size_in, transform.size_out))
            nengo.Connection(pre.neurons, post.neurons, transform=transform)
        return estimate(network)

    assert transposed(nengo.dists.Uniform(-1, 1)) == transposed(np.ones((2, 2, 1, 1))) < 1e8
