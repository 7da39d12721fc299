"""Identities of functions: equal if the functions do the same, refused if that is not known."""

import datetime
import functools
import math
import random
import statistics
from collections import Counter, OrderedDict, defaultdict
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import mujoco
import nengo
import numpy as np
import pytest
import scipy
import scipy.sparse.linalg
from hypothesis import given
from hypothesis import strategies as st
from nengo.dists import get_samples
from nengo.networks.product import dot_product_transform
from scipy.optimize import dual_annealing
from scipy.sparse import load_npz

from spikeport.digest import digest_of
from spikeport.function_identity import FunctionIdentity
from spikeport.networks import walking_policy
from spikeport.networks.policy_values import exact

SCALE = 2.0


def plain(value):
    if value is None or isinstance(value, (bool, int, float, str, np.ndarray)):
        return value
    raise TypeError(f"{type(value).__name__} has no identity that lasts")


def digest(function):
    return digest_of(FunctionIdentity(plain).of(function))


def closing_over(value, default=1.0):
    return lambda x, k=default: k * x * value


def scaled(x):
    return SCALE * x


def calls(x):
    return scaled(x) + 1


def recursive(n):
    return 1 if n == 0 else n * recursive(n - 1)


@given(st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_the_identity_of_a_closure_covers_its_values_and_defaults(a, b):
    assert digest(closing_over(a)) == digest(closing_over(a))
    equal = repr(a) == repr(b)
    assert (digest(closing_over(a)) == digest(closing_over(b))) == equal
    assert (digest(closing_over(1.0, a)) == digest(closing_over(1.0, b))) == equal


@given(st.lists(st.floats(), min_size=1), st.data())
def test_the_lowest_bit_of_a_matrix_in_a_closure_changes_its_identity(weights, data):
    changed = np.array(weights)
    changed.view(np.uint64)[data.draw(st.integers(0, len(weights) - 1))] ^= np.uint64(1)
    assert digest(closing_over(changed)) != digest(closing_over(np.array(weights)))


def test_a_closure_variable_that_is_set_later_changes_the_identity():
    def uses(x):
        return later * x

    empty = digest(uses)
    later = 2.0
    assert digest(uses) != empty
    first = digest(uses)
    later = 3.0
    assert digest(uses) != first


def test_equal_code_has_one_identity_and_different_code_another():
    assert digest(lambda x: x + 1) == digest(lambda x: x + 1)
    ones = [lambda x: x + 1, lambda x: x + 2, lambda x: x - 1, lambda x: math.sin(x)]
    ones += [lambda x: (lambda: x + 1)(), lambda x: (lambda: x + 2)(), lambda x, y=0: x + 1]
    assert len({digest(one) for one in ones}) == len(ones)


def test_the_identity_covers_module_variables_of_functions_that_are_called(monkeypatch):
    before = digest(calls)
    with monkeypatch.context() as other:
        other.setitem(globals(), "SCALE", 2.5)
        assert digest(calls) != before
    assert digest(calls) == before
    monkeypatch.setitem(globals(), "scaled", lambda x: 2 * x)
    assert digest(calls) != before


def test_attributes_whose_names_only_resemble_reading_functions_are_allowed():
    assert digest(lambda x: x.readout * x.loaded) == digest(lambda x: x.readout * x.loaded)


def test_library_functions_partials_and_bound_methods_have_distinct_identities():
    known = [np.sin, np.square, math.sin, np.linalg.norm, exact, functools.partial(exact, 1)]
    known += [functools.partial(exact, 2), recursive, "abc".join, "abd".join]
    assert len({digest(one) for one in known}) == len(known)


def imports_a_clock(x):
    import uuid

    return uuid.uuid4().int * x


def imports_a_neighbour(x):
    from tests.spikeport import test_cache

    return len(test_cache.__name__) * x


def imports_a_part_that_draws(x):
    from scipy import optimize

    return optimize.dual_annealing(np.sin, [(0, x)]).x


def imports_a_part_that_computes(x):
    from scipy import special

    return special.erf(x)


class Mine:
    def method(self, x):
        return x


class Gain(NamedTuple):
    k: float

    def times(self, x):
        return self.k * x


class Weights(list):
    def times(self, x):
        return self[0] * x


class Table(dict):
    def __missing__(self, key):
        return 2 * key


class Twice(functools.partial):
    def __call__(self, x):
        return 2 * super().__call__(x)


@functools.wraps(math.sin)
def wrapping(x):
    return SCALE * x


def test_the_identity_of_a_wrapper_covers_its_own_code(monkeypatch):
    before = digest(wrapping)
    monkeypatch.setitem(globals(), "SCALE", 2.5)
    assert digest(wrapping) != before


@pytest.mark.parametrize(
    "function",
    [
        lambda x: scipy.special.erf(x),
        lambda x: scipy.linalg.expm(x) @ scipy.linalg.inv(x),
        lambda x: scipy.interpolate.CubicSpline([0, 1], [0, 1])(x),
        lambda x: scipy.sparse.csr_array(x).toarray(),
        lambda x: nengo.LIFRate(tau_rc=0.05).rates(x, 1, 1),
        scipy.linalg.inv,
        scipy.ndimage.uniform_filter1d,
        dot_product_transform,
        imports_a_part_that_computes,
    ],
)
def test_functions_of_scipy_and_nengo_that_only_compute_have_an_identity(function):
    assert digest(function) == digest(function)


def test_the_identity_covers_the_class_of_a_container():
    pairs = {1.0: 2.0}
    ones = [pairs, OrderedDict(pairs), Counter(pairs), [1.0], (1.0,), {1.0}, frozenset({1.0})]
    ones += [defaultdict(kind, pairs) for kind in (None, list, dict, lambda: 1.0, lambda: 2.0)]
    assert len({digest(closing_over(one)) for one in ones}) == len(ones)
    with pytest.raises(TypeError, match="has no identity that lasts"):
        digest(closing_over(defaultdict(Mine)))


@pytest.mark.parametrize(
    "function",
    [
        Mine,
        Mine().method,
        random.random,
        random.Random(0).gauss,
        np.random.RandomState(0).randn,
        lambda x: statistics.NormalDist().samples(1)[0] * x,
        lambda x: random.random(),
        lambda x: len(open("file").name),  # noqa: SIM115
        lambda x: Mine().method(x),
        lambda x: np.load("w.npy") * x,
        functools.partial(np.load, "w.npy"),
        lambda x: np.fromfile("w.bin") * x,
        lambda x: np.random.default_rng().standard_normal() * x,
        lambda x: scipy.sparse.load_npz("w.npz") @ x,
        functools.partial(load_npz, "w.npz"),
        lambda x: scipy.io.loadmat("w.mat")["w"] @ x,
        lambda x: scipy.io.readsav("w.sav")["w"] @ x,
        lambda x: scipy.datasets.face() * x,
        lambda x: scipy.stats.qmc.Halton(1).integers(3) * x,
        lambda x: scipy.stats.bootstrap(([x, 1],), np.mean).standard_error,
        lambda x: scipy.optimize.dual_annealing(np.sin, [(0, x)]).x,
        lambda x: scipy.sparse.linalg.eigsh(x)[0],
        lambda x, package=scipy: package.optimize.dual_annealing(np.sin, [(0, x)]).x,
        dual_annealing,
        imports_a_part_that_draws,
        lambda x: nengo.dists.get_samples(nengo.dists.Uniform(0, 1), 1) * x,
        lambda x: nengo.Simulator(x),
        get_samples,
        lambda x: np.datetime64("now").astype(float) * x,
        lambda x: np.lib.format.read_array("w.npy") * x,
        lambda x: mujoco.MjSpec.from_file("robot.xml").option.timestep * x,
        functools.partial(mujoco.MjModel.from_xml_path, "robot.xml"),
        lambda x: float(Path("w.txt").read_text()) * x,
        lambda x: datetime.datetime.now().hour * x,
        lambda x: perf_counter() * x,
        lambda x: __import__("os").getpid() * x,
        walking_policy.load,
        imports_a_clock,
        imports_a_neighbour,
        closing_over(object()),
        closing_over(Gain(1.0)),
        closing_over(Weights([1.0])),
        closing_over(Table()),
        Twice(math.sin),
    ],
)
def test_functions_whose_results_may_change_have_no_identity(function):
    with pytest.raises(TypeError, match="has no identity that lasts"):
        digest(function)
