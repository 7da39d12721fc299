"""The arithmetic of NumPy 1, which applies only within its context."""

from typing import Any

import nengo
import nengo_loihi
import nengo_loihi.block
import nengo_loihi.builder.discretize
import nengo_loihi.neurons
import numpy as np
import pytest

from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.errors import CompileError
from tests.helpers.chip_networks import integer_blocks


def patched() -> tuple[Any, ...]:
    modules = (nengo_loihi.block, nengo_loihi.neurons)
    numpys = tuple(module.np for module in modules)
    builder = nengo_loihi.builder.discretize.discretize_compartment
    return (nengo_loihi.block.Synapse.max_abs_weight, builder, *numpys)


def test_numpy_1_semantics_end_with_their_context() -> None:
    before = patched()
    # Under NumPy 1, its own functions stay.
    n = 4 if np.lib.NumpyVersion(np.__version__) >= "2.0.0" else 2
    with numpy1_semantics():
        inside = patched()
    changed = [one is not other for one, other in zip(inside, before, strict=True)]
    assert changed == [True] * n + [False] * (4 - n)
    assert patched() == before


def test_numpy_1_semantics_end_with_an_exception() -> None:
    before = patched()
    with pytest.raises(ZeroDivisionError), numpy1_semantics():
        raise ZeroDivisionError
    assert patched() == before


def test_numpy_1_semantics_end_with_a_refused_build() -> None:
    before = patched()
    with nengo.Network(seed=1) as network:
        nengo.Connection(nengo.Ensemble(10, 1), nengo.Ensemble(10, 2)[1])
    with pytest.raises(CompileError):
        integer_blocks(network)
    assert patched() == before


def test_the_largest_weight_is_float64_inside_and_float32_outside() -> None:
    synapse = nengo_loihi.block.Synapse(1)
    with numpy1_semantics():
        synapse.set_weights(np.ones((1, 3)))
        assert type(synapse.max_abs_weight()) is float
    assert type(synapse.max_abs_weight()) is np.float32
