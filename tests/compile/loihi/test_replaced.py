"""Attributes that are replaced within a context, and stand-ins for modules."""

import math
from types import SimpleNamespace

import pytest

from spikeport.compile.loihi.replaced import StandIn, replaced


def test_an_attribute_is_replaced_and_restored() -> None:
    owner = SimpleNamespace(part="usual")
    with replaced(owner, "part", "ours"):
        assert owner.part == "ours"
        with replaced(owner, "part", "inner"):
            assert owner.part == "inner"
        assert owner.part == "ours"
    assert owner.part == "usual"


def test_an_attribute_is_restored_after_an_error() -> None:
    owner = SimpleNamespace(part="usual")
    with pytest.raises(ValueError, match="of the work"), replaced(owner, "part", "ours"):
        raise ValueError("of the work")
    assert owner.part == "usual"


def test_an_attribute_that_does_not_exist_cannot_be_replaced() -> None:
    with pytest.raises(AttributeError, match="absent"), replaced(SimpleNamespace(), "absent", 1):
        pass


def test_a_stand_in_has_the_attributes_of_its_module_except_those_replaced() -> None:
    stand_in = StandIn(math, pi=3)
    assert (stand_in.pi, stand_in.e) == (3, math.e)
    assert stand_in.sqrt is math.sqrt
    with pytest.raises(AttributeError, match="absent"):
        _ = stand_in.absent
