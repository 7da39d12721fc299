"""Groups of synapses that are split: bit for bit those of nengo-loihi."""

from collections.abc import Callable
from typing import Any

import nengo
import nengo_loihi.builder.split_blocks as split_blocks
import numpy as np
import pytest
from nengo_loihi.block import Synapse

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi import build as build_module
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.split_synapses import split_by_tables

FIELDS = ("label", "n_axons", "axon_to_weight_map", "axon_compartment_bases", "pop_type")


def layers() -> nengo.Network:
    """Return decoded, dense and sparse weights into an ensemble of two blocks."""
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(30, 1), nengo.Ensemble(1100, 2)
        nengo.Connection(a, b, transform=[[1], [0]])
        matrix = np.zeros((1100, 30))
        matrix[::3, ::2] = 1e-3
        nengo.Connection(a.neurons, b.neurons, transform=matrix)
        sparse = nengo.Sparse((1100, 30), indices=[[5, 1], [1099, 2], [7, 2]], init=[0.1, 0.2, 0.3])
        nengo.Connection(a.neurons, b.neurons, transform=sparse)
    return network


def groups(network: nengo.Network) -> list[tuple[Any, ...]]:
    floats = build(Rewrite(network, Names(network)), dt_s=0.001)
    return [numbers(synapse) for block in floats.blocks for synapse in block.synapses]


def numbers(synapse: Synapse) -> tuple[Any, ...]:
    named = [np.array(getattr(synapse, name)).tolist() for name in FIELDS]
    form = list(vars(synapse.synapse_cfg).values())
    rows = [(one.dtype.str, one.tolist()) for one in (*synapse.weights, *synapse.indices)]
    return named, form, rows


@pytest.mark.parametrize("name", ["layers", "convolution"])
def test_split_groups_of_synapses_equal_nengo_loihis(
    name: str, convolution: Callable[..., nengo.Network], monkeypatch: pytest.MonkeyPatch
) -> None:
    make = {"layers": layers, "convolution": convolution}[name]
    found = groups(make())
    monkeypatch.setattr(build_module, "split_by_tables", build_module.contextlib.nullcontext)
    assert found == groups(make())
    assert any("[1]" in str(label) for (label, *_), *_ in found)


def test_nengo_loihis_split_is_restored_after_the_context() -> None:
    usual = split_blocks.split_synapse
    with split_by_tables():
        assert split_blocks.split_synapse is not usual
    assert split_blocks.split_synapse is usual
