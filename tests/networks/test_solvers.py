"""Decoder solvers for populations that share an ensemble."""

import nengo
import numpy as np

from spikeport.networks.solvers import PerDimension, Tied, TiedInParts


def test_a_tied_decoder_is_the_best_single_number() -> None:
    activities = np.array([[1.0, 1.0], [2.0, 0.0], [0.0, 4.0]])
    values = np.array([[2.0, 0.0], [1.0, 1.0], [4.0, -1.0]])
    decoders, _ = Tied()(activities, values)
    # sums s are 2, 2 and 4: d = s Y / s s = (4 + 2 + 16, 0 + 2 - 4) / 24
    np.testing.assert_allclose(decoders, [[22 / 24, -2 / 24]] * 2)


def test_decoders_tied_in_parts_are_least_squares_with_one_unknown_for_each_part() -> None:
    activities = np.random.RandomState(0).rand(30, 5)
    wanted = activities @ [[2.0], [2.0], [2.0], [-1.0], [-1.0]]
    decoders, _ = TiedInParts(2)(activities, wanted)
    np.testing.assert_allclose(decoders, [[2.0], [2.0], [2.0], [-1.0], [-1.0]])
    single, _ = TiedInParts(1)(activities, wanted)
    np.testing.assert_allclose(single, Tied()(activities, wanted)[0])


def test_a_part_that_never_fires_decodes_nothing() -> None:
    decoders, _ = TiedInParts(2)(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([[3.0], [6.0]]))
    np.testing.assert_allclose(decoders, [[3.0], [0.0]])


def test_each_dimension_is_solved_from_its_own_neurons() -> None:
    rng = np.random.RandomState(0)
    activities, values = rng.rand(30, 6), rng.randn(30, 3)
    each = nengo.solvers.LstsqL2(reg=0.1)
    decoders, _ = PerDimension(2, each)(activities, values)
    expected = np.zeros((6, 3))
    for i in range(3):
        mine = slice(2 * i, 2 * i + 2)
        expected[mine, [i]] = each(activities[:, mine], values[:, [i]])[0]
    np.testing.assert_array_equal(decoders, expected)
    assert (decoders != 0).sum() == 6


def test_an_unnamed_solver_is_regularised_least_squares() -> None:
    rng = np.random.RandomState(0)
    activities, values = rng.rand(30, 4), rng.randn(30, 1)
    wanted, _ = nengo.solvers.LstsqL2(reg=0.05)(activities, values)
    np.testing.assert_array_equal(PerDimension(4)(activities, values)[0], wanted)
