"""Further imports of nengo-loihi's hardware half, which leave the first one as it is."""

import sys

import pytest
from nengo_loihi import hardware

from spikeport.backends.board.nxsdk.hardware import (
    KEEPERS,
    real_hardware,
    recording_hardware,
    require_nxsdk,
)
from spikeport.backends.board.nxsdk.package import modules
from spikeport.errors import MissingExtraError


def test_the_second_import_has_the_recording_nxsdk_and_the_first_none() -> None:
    before = {name: sys.modules[name] for name in KEEPERS}
    attributes = dict(vars(hardware))
    found = modules(None)
    second = recording_hardware(found)
    assert second.builder.NxsdkBoard is found["nxsdk.arch.n2a.n2board"].N2Board
    assert second.interface.SnipPhase is found["nxsdk.graph.processes.phase_enums"].Phase
    assert {name: sys.modules[name] for name in KEEPERS} == before
    assert dict(vars(hardware)) == attributes
    assert "nxsdk" not in sys.modules


def test_limits_are_lifted_in_one_import_alone() -> None:
    one, other = recording_hardware(modules(None)), recording_hardware(modules(None))
    one.allow_profiles(32, 8)
    assert (one.builder.MAX_COMPARTMENT_CFGS, one.builder.MAX_VTH_CFGS) == (33, 9)
    assert (other.builder.MAX_COMPARTMENT_CFGS, other.builder.MAX_VTH_CFGS) == (32, 8)


def test_without_nxsdk_the_error_says_where_it_comes_from() -> None:
    with pytest.raises(MissingExtraError, match="no NxSDK is installed here: Intel gives it"):
        require_nxsdk()
    with pytest.raises(MissingExtraError, match="`board serve --machine snips` steps it"):
        real_hardware()
