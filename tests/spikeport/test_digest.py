"""Digests of values: equal exactly for equal values, and the same in every process."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays, from_dtype
from pydantic import BaseModel

from spikeport.digest import digest_of


@dataclass
class Settings:
    n: object


class Model(BaseModel):
    n: int


LEAVES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(allow_nan=False),
    st.text(),
    st.binary(),
    arrays(np.float64, st.integers(0, 3), elements=from_dtype(np.dtype(float), allow_nan=False)),
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.tuples(inner, inner),
        st.dictionaries(st.text(), inner, max_size=3),
        st.builds(Settings, inner),
    ),
    max_leaves=8,
)


def described(value):
    """Return a description that differs if values differ."""
    if isinstance(value, np.ndarray):
        return ("array", value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, Settings):
        return ("Settings", described(value.n))
    if isinstance(value, dict):
        return ("dict", sorted((name, described(inner)) for name, inner in value.items()))
    if isinstance(value, list | tuple):
        return (type(value).__name__, [described(inner) for inner in value])
    return (type(value).__name__, repr(value))


@pytest.mark.slow
@given(VALUES, VALUES)
def test_digests_are_equal_exactly_if_values_are_equal(a, b):
    assert (digest_of(a) == digest_of(b)) == (repr(described(a)) == repr(described(b)))


@given(st.lists(st.floats(), min_size=1), st.data())
def test_any_changed_bit_of_a_weight_changes_the_digest(weights, data):
    changed = np.array(weights)
    bits = changed.view(np.uint64)
    at = data.draw(st.integers(0, len(weights) - 1))
    bits[at] ^= np.uint64(1) << np.uint64(data.draw(st.integers(0, 63)))
    assert digest_of(changed) != digest_of(np.array(weights))


def test_a_digest_is_the_same_in_every_process_and_order_of_keys():
    value = {"b": [1, None, 2.5], "a": np.eye(2), "c": Path("x")}
    code = (
        "import numpy as np; from pathlib import Path; from spikeport.digest import digest_of;"
        "print(digest_of({'a': np.eye(2), 'c': Path('x'), 'b': [1, None, 2.5]}))"
    )
    for seed in "0", "1":
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True)
        assert done.stdout.decode().strip() == digest_of(value)


def test_a_pydantic_model_is_digested_by_its_values():
    assert digest_of(Model(n=1)) == digest_of(Model(n=1)) != digest_of(Model(n=2))


@pytest.mark.parametrize("value", [lambda: None, object(), {"f": print}, {1: 2}, np.array([print])])
def test_a_value_without_a_lasting_identity_is_refused(value):
    with pytest.raises(TypeError, match="has no identity that lasts"):
        digest_of(value)
