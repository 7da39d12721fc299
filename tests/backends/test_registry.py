import nengo
import pytest

import spikeport
from spikeport.backends import registry
from spikeport.errors import UsageError


def test_an_unknown_backend_is_refused_with_those_there_are() -> None:
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
