"""An attribute is another one within the context, and the same as before behind it."""

import math
from types import SimpleNamespace

import pytest

from spikeport.compile.loihi.replaced import StandIn, replaced


def test_an_attribute_is_replaced_and_comes_back() -> None:
    owner = SimpleNamespace(part="usual")
    with replaced(owner, "part", "ours"):
        assert owner.part == "ours"
        with replaced(owner, "part", "inner"):
            assert owner.part == "inner"
        assert owner.part == "ours"
    assert owner.part == "usual"


def test_it_comes_back_from_an_error() -> None:
    owner = SimpleNamespace(part="usual")
    with pytest.raises(ValueError, match="of the work"), replaced(owner, "part", "ours"):
        raise ValueError("of the work")
    assert owner.part == "usual"


def test_a_part_that_is_not_there_is_no_part() -> None:
    with pytest.raises(AttributeError, match="absent"), replaced(SimpleNamespace(), "absent", 1):
        pass


def test_a_stand_in_has_what_its_module_has_but_for_what_it_was_given() -> None:
    stand_in = StandIn(math, pi=3)
    assert (stand_in.pi, stand_in.e) == (3, math.e)
    assert stand_in.sqrt is math.sqrt
    with pytest.raises(AttributeError, match="absent"):
        _ = stand_in.absent
