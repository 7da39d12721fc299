"""Refusals, on every chip, of spikes and learning errors that an image cannot take."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from spikeport.backends.host_checks import HostChecks
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.errors import BackendError
from tests.helpers.images import Block, Group, Parts

RULE = (1, 4, -7, 10, 8.5, 2, 4)
IMAGE = Parts([Block(n=4)], [Group([[0] * 4]), Group([[0] * 4], learning=RULE)]).image()
REFUSED = [
    ({0: np.zeros(2)}, "synapse group 0 does not learn; those that do: 1"),
    ({999: np.zeros(2)}, "synapse group 999 does not learn; those that do: 1"),
    ({1: np.zeros(4)}, r"synapse group 1: its error has shape \(4,\), not \(2,\)"),
]


@pytest.mark.parametrize(("errors", "reason"), REFUSED)
def test_errors_for_a_wrong_group_or_of_a_wrong_shape_are_refused(
    errors: Mapping[int, np.ndarray], reason: str
) -> None:
    nothing = np.zeros(0, dtype=int)
    for chip in (NativeChip(IMAGE, 0), NengoLoihiChip(IMAGE, 0)):
        with pytest.raises(BackendError, match=reason):
            chip.step(nothing, errors)
        chip.step(nothing, {1: np.zeros(2)})
        chip.close()


def test_an_image_that_does_not_learn_takes_no_errors() -> None:
    checks = HostChecks(Parts([Block()], [Group([[0]])]).image())
    checks.check_errors({})
    with pytest.raises(BackendError, match="group 0 does not learn; those that do: none"):
        checks.check_errors({0: np.zeros(1)})


RANGE = "but the image has only 2 sources, numbered from 0"
GIVE = "give the numbers of the sources that spike, as a (n,) array of integers"
KINDS = pytest.mark.parametrize("kind", [NativeChip, NengoLoihiChip])
Kind = type[NativeChip] | type[NengoLoihiChip]


@KINDS
@pytest.mark.parametrize(
    ("listed", "message"),
    [
        ([-1], f"the host sent 1 spikes of sources -1 to -1, {RANGE}"),
        ([2], f"the host sent 1 spikes of sources 2 to 2, {RANGE}"),
        ([0.0], f"the host's spikes are float64 of shape (1,); {GIVE}"),
        ([[0]], f"the host's spikes are int64 of shape (1, 1); {GIVE}"),
    ],
)
def test_sources_that_the_image_does_not_have_are_refused(
    kind: Kind, listed: list[Any], message: str
) -> None:
    chip = kind(Parts([Block(n=4)], [Group([[0] * 4])], [2]).image(), 0)
    with pytest.raises(BackendError) as refused:
        chip.step(np.array(listed), {})
    assert str(refused.value) == message
    chip.step(np.array([1]), {})
    chip.close()


@KINDS
def test_a_closed_chip_cannot_step(kind: Kind) -> None:
    chip = kind(IMAGE, 0)
    chip.close()
    with pytest.raises(BackendError, match="the chip is closed"):
        chip.step(np.zeros(0, dtype=int), {})
