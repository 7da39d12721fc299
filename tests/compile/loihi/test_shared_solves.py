"""Decoders that connections share: bit for bit the ones that each would have."""

from collections.abc import Iterator
from unittest.mock import patch

import nengo
import nengo_loihi.builder.connection as connections
import numpy as np
import pytest
from nengo.solvers import LstsqL2, LstsqNoise, Solver

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi import build as build_module
from spikeport.compile.loihi import shared_solves
from spikeport.compile.loihi.build import build


def fan(solver: Solver, n_targets: int = 3) -> nengo.Network:
    """Return an ensemble that several connections decode: all the same value, one its square."""
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(30, 2)
        for _ in range(n_targets):
            nengo.Connection(a, nengo.Ensemble(10, 2), solver=solver)
        nengo.Connection(a, nengo.Ensemble(10, 2), function=lambda x: x**2, solver=solver)
    return network


@pytest.fixture
def solved() -> Iterator[list[nengo.Connection]]:
    """Yield the list of connections for which decoders were solved."""
    found = []
    usual = connections.solve_for_decoders

    def counted(conn: nengo.Connection, *values: object, **named: object) -> object:
        found.append(conn)
        return usual(conn, *values, **named)

    with patch.object(connections, "solve_for_decoders", counted):
        yield found


def decoders(network: nengo.Network) -> list[np.ndarray]:
    floats = build(Rewrite(network, Names(network)), dt_s=0.001)
    return [floats.model.params[connection].weights for connection in network.all_connections]


@pytest.mark.parametrize("weights", [False, True])
def test_equal_decoders_are_solved_once(solved: list[nengo.Connection], weights: bool) -> None:
    found = decoders(fan(LstsqL2(weights=weights)))
    assert len(solved) == 2
    with patch.object(build_module, "shared_solves", build_module.contextlib.nullcontext):
        apart = decoders(fan(LstsqL2(weights=weights)))
    assert [a.tobytes() for a in found] == [b.tobytes() for b in apart]


def test_solvers_that_may_draw_random_numbers_are_run_for_each_connection(
    solved: list[nengo.Connection],
) -> None:
    found = decoders(fan(LstsqNoise()))
    assert len(solved) == 4
    assert not np.array_equal(found[0], found[1])


def test_a_solution_for_other_evaluation_points_is_not_shared(
    solved: list[nengo.Connection],
) -> None:
    network = fan(LstsqL2(), n_targets=1)
    with network:
        a = network.ensembles[0]
        nengo.Connection(a, nengo.Ensemble(10, 2), eval_points=[[0, 0], [1, 0], [0, 1]])
    decoders(network)
    assert len(solved) == 3


def test_only_the_most_recent_solutions_are_kept(solved: list[nengo.Connection]) -> None:
    with nengo.Network(seed=1) as network:
        ensembles = [nengo.Ensemble(10, 1) for _ in range(shared_solves.MOST_KEPT + 1)]
        for source in (*ensembles, ensembles[0], ensembles[-1]):
            nengo.Connection(source, nengo.Ensemble(10, 1))
    decoders(network)
    assert len(solved) == len(ensembles) + 1


def test_nengo_loihis_solve_is_restored_after_the_context() -> None:
    usual = connections.solve_for_decoders
    with shared_solves.shared_solves():
        assert connections.solve_for_decoders is not usual
    assert connections.solve_for_decoders is usual
