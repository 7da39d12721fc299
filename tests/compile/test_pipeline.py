"""Errors of networks that cannot be compiled: they name the object and the cure."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import nengo
import numpy as np
import pytest
from nengo_loihi.decode_neurons import OnOffDecodeNeurons

from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.loihi.build_settings import BuildSettings
from spikeport.compile.pipeline import compile_network
from spikeport.compile.rewriting.relays import compartments_at_least
from spikeport.errors import CompileError
from tests.helpers.chip_files import chip_file
from tests.helpers.small_networks import scope_of


def pair() -> tuple[nengo.Ensemble, nengo.Ensemble]:
    a, b = (nengo.Ensemble(10, 1, label=label) for label in "ab")
    return a, b


def undefined_gain() -> None:
    a = nengo.Ensemble(10, 1, label="a", gain=np.full(10, np.nan), bias=np.ones(10))
    nengo.Connection(a, nengo.Ensemble(10, 1, label="b"))


def infinite_weights() -> None:
    a, b = pair()
    nengo.Connection(a.neurons, b.neurons, transform=np.full((10, 10), np.inf))


def undefined_function() -> None:
    nengo.Connection(*pair(), function=lambda x: x * np.nan)


def infinite_function() -> None:
    nengo.Connection(*pair(), function=lambda x: np.full_like(x, np.inf))


def undefined_decoders() -> None:
    nengo.Connection(*pair(), solver=nengo.solvers.NoSolver(np.full((10, 1), np.nan)))


def undefined_distribution() -> None:
    a = nengo.Ensemble(10, 1, label="a", gain=nengo.dists.Choice([np.nan]), bias=np.ones(10))
    nengo.Connection(a, nengo.Ensemble(10, 1, label="b"))


def undefined_points() -> None:
    a = nengo.Ensemble(10, 1, label="a", eval_points=np.full((5, 1), np.nan))
    nengo.Connection(a, nengo.Ensemble(10, 1, label="b"))


def very_long_synapse() -> None:
    nengo.Connection(*pair(), synapse=100.0)


def sparse_decoded_transform() -> None:
    nengo.Connection(*pair(), transform=nengo.Sparse((1, 1), indices=[[0, 0]]))


def second_order_synapse() -> None:
    nengo.Connection(*pair(), synapse=nengo.LinearFilter([1], [0.1, 1]))


def second_order_synapse_of_neurons() -> None:
    a, b = pair()
    nengo.Connection(a.neurons, b.neurons, synapse=nengo.LinearFilter([1], [0.1, 1]))


def bursting_neurons() -> None:
    a = nengo.Ensemble(10, 1, label="a", neuron_type=nengo.Izhikevich())
    nengo.Connection(a, nengo.Ensemble(10, 1, label="b"))


FUNCTION = "a -> b: SP011 finite numbers: NaN or infinity in what its function returns"


@pytest.mark.parametrize("passes", ["as_written", "compact"])
@pytest.mark.parametrize(
    ("make", "names"),
    [
        (undefined_gain, "a: SP011 finite numbers: NaN or infinity in gain"),
        (infinite_weights, "a -> b: SP011 finite numbers: NaN or infinity in transform"),
        (undefined_function, FUNCTION),
        (infinite_function, FUNCTION),
        (undefined_decoders, "a -> b: SP011 finite numbers: NaN or infinity in "),
        (undefined_distribution, "a: SP011 finite numbers: NaN or infinity in gain"),
        (undefined_points, "a: SP011 finite numbers: NaN or infinity in eval_points"),
        (very_long_synapse, "a -> b"),
        (second_order_synapse, "a -> b: SP005 synapse: LinearFilter"),
        (second_order_synapse_of_neurons, "a -> b: SP005 synapse: LinearFilter"),
        (bursting_neurons, "a: SP002 neuron type: Izhikevich"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_an_error_names_the_object_and_a_cure(
    make: Callable[[], None], names: str, passes: str
) -> None:
    with nengo.Network(seed=1) as network:
        make()
    with pytest.raises(CompileError) as raised:
        compile_network(network, pipeline=passes)
    assert names in str(raised.value)
    assert "; cure: " in str(raised.value)


def test_a_sparse_transform_of_decoded_values_is_refused_unless_it_is_multiplied_out() -> None:
    with nengo.Network(seed=1) as network:
        sparse_decoded_transform()
    with pytest.raises(CompileError, match=r"^a -> b: nengo-loihi refuses it: .*; cure: "):
        compile_network(network)
    assert compile_network(network, pipeline="compact").report.resources()["cores"].used == 1


def test_weights_of_zero_compile_with_a_hint() -> None:
    with nengo.Network(seed=1) as network:
        a, b = pair()
        nengo.Connection(a.neurons, b.neurons, transform=np.zeros((10, 10)))
    hints = {(hint.id, hint.object) for hint in compile_network(network).report.hints}
    assert ("SP402", "b") in hints


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [BuildSettings(decode_neurons=OnOffDecodeNeurons()), BuildSettings(remove_passthrough=False)],
)
def test_a_network_that_fits_with_the_settings_of_its_build_is_not_refused(
    settings: BuildSettings, tmp_path: Path
) -> None:
    with nengo.Network(seed=1) as network:
        ensembles = [nengo.Ensemble(8, 1) for _ in range(60)]
        for pre, post in pairwise(ensembles):
            node = nengo.Node(size_in=1)
            nengo.Connection(pre, node)
            nengo.Connection(node, post, synapse=None)
    # With the usual settings, 128 cores of 12 compartments are too few.
    assert compartments_at_least(scope_of(network)) == 60 * 8 + 59 * 20 > 128 * 12
    small = chip_file(tmp_path / "small.toml", compartments=12)
    image = compile_network(network, small, settings=settings).image
    assert image.n_compartments < 128 * 12


def test_every_block_that_is_too_large_for_the_chip_is_listed(tmp_path: Path) -> None:
    small = chip_file(tmp_path / "small.toml", compartments=4)
    with nengo.Network(seed=1) as network:
        nengo.Connection(*pair())
    with pytest.raises(DoesNotFitError) as raised:
        compile_network(network, small, pipeline="")
    assert {(v.id, v.object, v.limit) for v in raised.value.violations} == {
        ("SP103", "a", "4"),
        ("SP103", "b", "4"),
        ("SP103", "a -> b", "4"),
    }
