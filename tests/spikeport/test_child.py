"""A child of our own command line: its first line is waited for, its last words are kept."""

import pytest

from spikeport.child import Child
from spikeport.errors import BackendError


def test_a_child_that_cannot_start_says_why() -> None:
    with pytest.raises(BackendError, match=r"the chip's server did not start: error: .*nonsense"):
        Child("chip", ["show", "nonsense"])
