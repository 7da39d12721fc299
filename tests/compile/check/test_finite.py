"""Refusals of numbers that are not finite."""

import numpy as np
import pytest

from spikeport.compile.check.finite import NOT_FINITE, not_finite, refused_or_not_finite


def test_the_refusal_names_the_attribute_with_nan_or_infinity() -> None:
    text = str(not_finite("a -> b", "gain"))
    assert text.startswith("a -> b: SP011 finite numbers: NaN or infinity in gain, limit finite ")
    assert "; cure: look for a division by zero" in text


def test_numpys_finite_check_blames_the_function_and_other_errors_the_builder() -> None:
    with pytest.raises(ValueError, match=NOT_FINITE) as caught:
        np.asarray_chkfinite([np.nan])
    found = refused_or_not_finite(("a -> b",), caught.value)
    assert str(found) == str(not_finite("a -> b", "what its function returns"))
    other = str(refused_or_not_finite(("a -> b",), ValueError("no such shape")))
    assert other.startswith("a -> b: nengo-loihi refuses it: ")
    assert "no such shape; cure: change this object" in other
