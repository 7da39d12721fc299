from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal, Optional

import numpy as np
import pytest
from pydantic import Field

from spikeport.errors import UsageError
from spikeport.key_values import parse


def target(
    whole: int,
    untyped,
    number: float = 0.5,
    yes: bool = False,
    text: str = "",
    maybe: int | None = None,
    old_maybe: Optional[int] = None,  # noqa: UP045
    quoted: "int | None" = None,
    unresolved: "NotImported" = 3,  # type: ignore[name-defined]  # noqa: F821
    plain=1,
    plain_number=1.5,
    plain_yes=True,
    plain_text="a",
    nothing=None,
    switch_or_text: bool | str = False,
    whole_or_number: int | float = 0,
    bounded: Annotated[int, Field(ge=1)] | None = None,
    choice: Literal["red", "blue"] = "red",
    numbered: Literal[1, 2] = 1,
    several: "list[int] | None" = None,
    pair: tuple[float, float] = (0.0, 1.0),
    many: list = [],  # noqa: B006
    plain_pair=(1, 2),
    plain_map={},  # noqa: B006
    *,
    keyword: int = 0,
    **rest: int,
):
    pass


def refusal(pairs, function=target):
    with pytest.raises(UsageError) as caught:
        parse(pairs, function, "network 'n'")
    return str(caught.value)


@pytest.mark.parametrize(
    ("pair", "value"),
    [
        ("whole=3", 3),
        ("whole=-3", -3),
        ("number=2", 2.0),
        ("number=1e-3", 0.001),
        ("text=a=b", "a=b"),
        ("text=", ""),
        ("maybe=4", 4),
        ("old_maybe=4", 4),
        ("quoted=4", 4),
        ("unresolved=4", 4),
        ("plain=2", 2),
        ("plain_number=2", 2.0),
        ("plain_yes=no", False),
        ("plain_text=2", "2"),
        ("nothing=2", 2),
        ("nothing=.5", 0.5),
        ("nothing=false", False),
        ("nothing=True", True),
        ("nothing=[1, 2]", [1, 2]),
        ("nothing=y", "y"),
        ("untyped=false", False),
        ("switch_or_text=yes", True),
        ("switch_or_text=file.npz", "file.npz"),
        ("whole_or_number=2", 2),
        ("whole_or_number=2.5", 2.5),
        ("bounded=1", 1),
        ("choice=blue", "blue"),
        ("numbered=2", 2),
        ("several=[1, 2]", [1, 2]),
        ("pair=[1, 2.5]", (1.0, 2.5)),
        ("many=[3, 4]", [3, 4]),
        ("plain_pair=[50, 60]", (50, 60)),
        ('plain_map={"a": 1}', {"a": 1}),
        ("keyword=5", 5),
    ],
)
def test_values_are_converted_by_annotation_or_default(pair, value):
    (parsed,) = parse([pair], target, "it").values()
    assert parsed == value
    assert type(parsed) is type(value)


@pytest.mark.parametrize("text", ["true", "True", "YES", "1"])
def test_true_is_spelled_in_many_ways(text):
    assert parse([f"yes={text}"], target, "it") == {"yes": True}


@pytest.mark.parametrize("text", ["false", "FALSE", "No", "0"])
def test_false_is_spelled_in_many_ways(text):
    assert parse([f"yes={text}"], target, "it") == {"yes": False}


def test_several_settings_are_parsed_together():
    assert parse(["whole=1", "text=t"], target, "it") == {"whole": 1, "text": "t"}


def test_no_settings_give_no_arguments():
    assert parse([], target, "it") == {}


def test_a_dataclass_is_parsed_by_its_fields():
    @dataclass
    class Sizes:
        m1: int | None = None
        preset: str = "lean"

    assert parse(["m1=7", "preset=paper"], Sizes, "it") == {"m1": 7, "preset": "paper"}


def test_a_partial_function_takes_the_parameters_of_the_function_it_wraps():
    assert parse(["number=2"], partial(target, text="t"), "it") == {"number": 2.0}


def test_an_unknown_key_lists_the_keys():
    assert refusal(["size=1"], lambda b=1, a=2: None) == (
        "unknown key of network 'n' 'size'; choose from: a, b"
    )


def test_a_function_without_parameters_takes_no_key():
    assert refusal(["size=1"], lambda: None) == "unknown key of network 'n' 'size'; it takes none"


def test_the_name_of_a_double_star_parameter_is_not_a_key():
    assert "'rest'" in refusal(["rest=1"])


def test_a_setting_without_an_equals_sign_is_refused():
    assert refusal(["whole"]) == "--set whole: expected KEY=VALUE"


def test_a_key_given_twice_is_refused():
    assert refusal(["whole=1", "whole=1"]) == "--set whole: given twice"


@pytest.mark.parametrize(
    ("pair", "expected"),
    [
        ("whole=1.5", "a whole number"),
        ("whole=", "a whole number"),
        ("maybe=none", "a whole number"),
        ("number=fast", "a number"),
        ("yes=maybe", "true or false"),
        ("whole_or_number=few", "a number"),
        ("choice=green", "'red' or 'blue'"),
        ("plain_pair=50,60", "JSON, as in [1, 2]"),
    ],
)
def test_the_error_of_a_value_that_does_not_convert_names_the_expected_kind(pair, expected):
    assert refusal([pair]) == f"--set {pair}: expected {expected}"


def test_the_error_of_a_value_out_of_bounds_names_the_bound():
    assert refusal(["bounded=0"]) == ("--set bounded=0: input should be greater than or equal to 1")


def test_a_class_is_parsed_by_the_parameters_of_its_constructor():
    class Sizes:
        m1: str

        def __init__(self, m1: "int") -> None:
            pass

    assert parse(["m1=7"], Sizes, "it") == {"m1": 7}


def test_quoted_annotations_of_a_partial_function_are_resolved():
    def scaled(by: "float | None", size: "int | None" = None):
        pass

    assert parse(["size=7"], partial(scaled, 2.0), "it") == {"size": 7}


def test_parameters_are_parsed_by_defaults_if_annotations_cannot_be_evaluated():
    def odd(first: "1 / 0", size=7):
        pass

    assert parse(["first=a", "size=3"], odd, "it") == {"first": "a", "size": 3}


def test_a_callable_without_a_signature_is_refused():
    assert refusal(["a=1"], int) == (
        "network 'n': its parameters cannot be read: no signature found for builtin type "
        "<class 'int'>"
    )


def of_arrays(gains: list[np.ndarray] | None = None) -> object:
    return gains


def test_lists_of_values_that_json_does_not_have_are_read_as_lists():
    assert parse(["gains=[[1, 2]]"], of_arrays, "it") == {"gains": [[1, 2]]}
