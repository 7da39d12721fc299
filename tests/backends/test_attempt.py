"""Errors of a network's own functions, with the place in the run where they occurred."""

import pytest

from spikeport.backends.attempt import attempt
from spikeport.errors import BackendError, UsageError


def test_the_result_of_the_call_is_returned() -> None:
    assert attempt("step 1", lambda: 3) == 3


@pytest.mark.parametrize("raised", [ValueError("no"), StopIteration("no"), RuntimeError("no")])
def test_an_error_is_reported_with_its_step_and_source(raised: Exception) -> None:
    def call() -> None:
        raise raised

    with pytest.raises(BackendError) as caught:
        attempt("step 1", call)
    words = f"step 1: the network raised {type(raised).__name__}: no (tests/backends/test_attempt"
    assert words in str(caught.value)
    assert caught.value.__cause__ is raised


def test_errors_of_spikeport_pass_unchanged() -> None:
    def call() -> None:
        raise UsageError("a cure")

    with pytest.raises(UsageError, match=r"^a cure$"):
        attempt("step 1", call)
