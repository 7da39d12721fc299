"""Verdicts of the command line and of the simulator on networks that may not fit a chip."""

import inspect
import warnings
from collections.abc import Callable
from typing import NamedTuple

import nengo
import pytest

from spikeport import Simulator
from spikeport.errors import SpikeportError
from tests.helpers import refused_networks

NETWORKS = dict(inspect.getmembers(refused_networks, inspect.isfunction))
OPTIONS = {
    "": {},
    "-p compact": {"pipeline": "compact"},
    "--offload": {"offload": True},
}


class Verdict(NamedTuple):
    """The verdict on a network: the exit code, an error, and the end of the output."""

    code: int
    error: str
    end: str


def of_simulator(network: nengo.Network, options: dict[str, object]) -> Verdict:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            sim = Simulator(network, **options)
        except SpikeportError as error:
            return Verdict(error.exit_code, f"error: {error}\n", "")
    with sim:
        if sim.image is None:
            texts = [str(one.message) for one in caught]
            return Verdict(0, "", next(one for one in texts if "in float Nengo" in one))
        return Verdict(0, "", f"image {sim.image.digest[:16]}")


@pytest.mark.parametrize("words", OPTIONS, ids=lambda words: words or "default")
@pytest.mark.parametrize("name", NETWORKS)
def test_command_line_and_simulator_give_the_same_verdict(
    spikeport: Callable[..., object], name: str, words: str
) -> None:
    expected = of_simulator(NETWORKS[name](), OPTIONS[words])
    spec = f"{refused_networks.__name__}:{name}"
    done = spikeport("compile", spec, *words.split())
    assert (done.code, done.err) == (expected.code, expected.error)
    # The report names what was moved before the verdict, the warning behind it.
    assert all(line in done.out for line in expected.end.splitlines())


@pytest.mark.slow
def test_the_list_has_networks_of_every_verdict() -> None:
    found = {name: of_simulator(make(), {}) for name, make in NETWORKS.items()}
    fit = [name for name, one in found.items() if one.end.startswith("image")]
    on_host = [name for name, one in found.items() if "in float Nengo" in one.end]
    refused = [name for name, one in found.items() if one.code == 1]
    assert (len(fit), len(on_host), len(refused)) == (2, 2, 8)
    offloaded = {name: of_simulator(make(), {"offload": True}) for name, make in NETWORKS.items()}
    # Moving an operation to the host does not help if float Nengo cannot compute it either.
    assert [name for name, one in offloaded.items() if one.code] == [
        "with_a_sparse_transform",
        "with_an_undefined_function",
    ]
