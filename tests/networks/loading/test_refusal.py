"""Refusals of policy files, with what was expected and what was found."""

from pathlib import Path

import pytest

from spikeport.errors import MissingExtraError, UsageError
from spikeport.networks.loading.refusal import extra, refusing
from spikeport.reading.mismatch import MismatchError


def test_a_mismatch_is_refused_with_the_files_name() -> None:
    with pytest.raises(UsageError) as caught, refusing(Path("a/b.pt")):
        raise MismatchError("a horse", "a cow")
    assert str(caught.value) == (
        "policy file 'a/b.pt': expected a horse, found a cow; "
        "see docs/convert.md, 'Refused policies'"
    )


def test_cure_and_kind_can_be_replaced_and_other_errors_pass_through() -> None:
    with pytest.raises(UsageError, match=r"^stable 'x': .* found a cow; buy a horse$"):  # noqa: SIM117
        with refusing(Path("x"), "buy a horse", "stable"):
            raise MismatchError("a horse", "a cow")
    with pytest.raises(ZeroDivisionError), refusing(Path("x")):
        raise ZeroDivisionError


def test_a_package_that_is_absent_names_the_extra() -> None:
    with pytest.raises(MissingExtraError) as caught:
        extra("no_such_package")
    assert str(caught.value) == (
        "reading this file needs the package no_such_package, which is absent; "
        "install it with: pip install 'spikeport[convert]'"
    )
