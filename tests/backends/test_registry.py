from typing import NoReturn

import nengo
import pytest

import spikeport
from spikeport.backends import registry
from spikeport.backends.native.chip import NativeChip
from spikeport.errors import UsageError


def test_an_unknown_backend_is_refused_with_the_known_names() -> None:
    known = ", ".join(sorted(registry.BACKENDS))
    with pytest.raises(UsageError) as raised:
        registry.get("abacus")
    assert str(raised.value) == f"unknown backend 'abacus'; choose from: {known}"
    assert {"nengo-loihi", "reference"} <= set(registry.BACKENDS)


def test_a_simulator_refuses_an_unknown_backend_before_it_builds() -> None:
    with pytest.raises(UsageError, match="unknown backend 'abacus'"):
        spikeport.Simulator(nengo.Network(), backend="abacus")


def test_every_backend_is_filed_under_its_name() -> None:
    assert all(backend.name == name for name, backend in registry.BACKENDS.items())


class Failing(nengo.Process):
    """A process that no host can be built with."""

    def make_step(self, *_args: object) -> NoReturn:
        raise RuntimeError("no step")


def test_a_chip_whose_host_cannot_be_built_is_freed(monkeypatch: pytest.MonkeyPatch) -> None:
    freed: list[NativeChip] = []
    monkeypatch.setattr(NativeChip, "close", lambda self: freed.append(self))
    with nengo.Network(seed=0) as network:
        source = nengo.Node(Failing(default_size_in=0, default_size_out=1))
        nengo.Connection(source, nengo.Ensemble(5, 1))
    with pytest.raises(RuntimeError, match=r"^no step$"):
        spikeport.Simulator(network, backend="native")
    assert len(freed) == 1
