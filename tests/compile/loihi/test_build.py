"""Float blocks that nengo-loihi's builder makes, and its refusals."""

from collections.abc import Callable
from typing import Any

import nengo
import nengo_loihi
import numpy as np
import pytest

from spikeport.errors import CompileError
from tests.helpers.chip_networks import integer_blocks, recurrent


def test_blocks_are_named_after_ensembles_and_connections() -> None:
    assert integer_blocks(recurrent()).floats.labels == ("a", "b", "a -> a", "b -> probes[0]")


def test_pieces_of_a_block_are_numbered(convolution: Callable[..., nengo.Network]) -> None:
    assert integer_blocks(convolution()).floats.labels == ("image", "maps[1/2]", "maps[2/2]")


def test_the_entry_of_a_block_holds_its_kind_and_owner() -> None:
    entries = integer_blocks(recurrent()).floats.entries
    assert [entry.kind for entry in entries] == ["ensemble", "ensemble", "relay", "readout"]
    assert [entry.owner for entry in entries] == ["a", "b", "a -> a", "b -> probes[0]"]


def test_a_transform_that_is_not_finite_is_refused() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, label="a")
        b = nengo.Ensemble(10, 1, label="b")
        nengo.Connection(a, b, transform=np.nan)
    with pytest.raises(CompileError) as raised:
        integer_blocks(network)
    assert str(raised.value) == (
        "a -> b: SP011 finite numbers: NaN or infinity in weights or biases, limit finite numbers; "
        "cure: look for a division by zero, a root or logarithm out of range, or an overflow there"
    )


HOST = (
    "or keep its ensembles on the host with net.config[ensemble].on_chip = False, after "
    "spikeport.add_params(net)"
)


def test_a_refusal_by_bare_assertion_names_the_object() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, label="a")
        b = nengo.Ensemble(10, 2, label="b")
        nengo.Connection(a, b[1])
    with pytest.raises(CompileError) as raised:
        integer_blocks(network)  # without lint, which has a rule for this
    assert str(raised.value) == (
        "a -> b: nengo-loihi refuses it: AssertionError at build_full_chip_connection: "
        f"assert post_slice == slice(None); cure: change this object, {HOST}"
    )


def test_a_refusal_with_reason_gives_the_reason_without_addresses() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, encoders=np.zeros((10, 1)))
        nengo.Connection(a, a)
    with pytest.raises(CompileError) as raised:
        integer_blocks(network)
    assert str(raised.value) == (
        "ensembles[0]: Nengo refuses it: <Ensemble (unlabeled)>: NaNs detected in encoders. "
        "This usually means that you have zero-length encoders; when normalized, these result in "
        "NaNs. Ensure all encoders have non-zero length, or set `normalize_encoders=False`.; "
        "cure: give every encoder a length, or set normalize_encoders=False"
    )


def test_an_error_in_a_users_function_names_the_connection() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, label="a")
        b = nengo.Ensemble(10, 1, label="b")
        nengo.Connection(a, b, function=lambda x: 1 / 0 if x.any() else 0.0)
    with pytest.raises(CompileError) as raised:
        integer_blocks(network)
    assert str(raised.value) == (
        "a -> b: Nengo refuses it: ZeroDivisionError at <lambda>: nengo.Connection(a, b, "
        "function=lambda x: 1 / 0 if x.any() else 0.0); cure: change this object"
    )


def split_ensemble() -> nengo.Ensemble:
    network = nengo.Network.context[-1]
    nengo_loihi.add_params(network)
    a = nengo.Ensemble(10, 1, label="a")
    network.config[a].block_shape = nengo_loihi.BlockShape((5,), (10,))
    return a


@pytest.mark.parametrize("neurons", [[7, 2], slice(None, None, -1)], ids=["list", "backwards"])
def test_split_neurons_must_be_read_in_order(neurons: Any) -> None:
    with nengo.Network(seed=1) as network:
        nengo.Probe(split_ensemble().neurons[neurons])
    with pytest.raises(CompileError) as raised:
        integer_blocks(network)
    assert str(raised.value) == (
        "a: a probe reads its neurons out of order, which fails because they are split over "
        "several cores; cure: probe them in ascending order"
    )


def test_population_16_axons_must_start_at_multiples_of_4() -> None:
    kernel = np.ones((2, 2, 1, 3))
    filters = nengo.Convolution(3, (3, 3, 1), kernel_size=(2, 2), init=kernel)
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        a = nengo.Ensemble(9, 1, label="a")
        b = nengo.Ensemble(12, 1, label="b", gain=np.ones(12), bias=np.ones(12))
        edge = nengo.Connection(a.neurons, b.neurons, transform=filters)
        network.config[edge].pop_type = 16
    with pytest.raises(CompileError) as raised:
        integer_blocks(network)
    assert "b" in getattr(raised.value, "about", ())  # so that --offload can move it
    assert str(raised.value) == (
        "b: axons of population type 16 start at compartments that are not multiples of 4; cure: "
        "use pop_type 32, or channels_last=True with a multiple of 4 filters, also in each block"
    )
