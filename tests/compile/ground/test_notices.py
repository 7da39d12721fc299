"""Warnings of a compile, with the objects that they are about."""

import contextlib
import warnings

import nengo
import numpy as np
import pytest

from spikeport.compile.ground.notices import collected_warnings, warnings_about
from spikeport.compile.pipeline import compile_network


def test_warnings_are_collected_and_passed_on_with_their_category() -> None:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("default")
        with collected_warnings() as collected:
            warnings.warn("one thing", RuntimeWarning, stacklevel=1)
        assert [str(one.message) for one in collected.caught] == ["one thing"]
    assert [(str(one.message), one.category) for one in seen] == [("one thing", RuntimeWarning)]
    assert seen[0].filename == __file__


def test_warnings_that_are_passed_on_can_be_filtered_by_module_spikeport_compile() -> None:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", module="spikeport.compile")
        with collected_warnings():
            warnings.warn("one thing", stacklevel=1)
    assert seen == []


def test_warnings_of_the_builder_reach_the_user_and_the_report() -> None:
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(5, 1, n_eval_points=10, eval_points=[[0.1], [0.2]])
    with pytest.warns(UserWarning, match="Number of eval_points doesn't match") as seen:
        report = compile_network(network).report
    assert set(report.warnings) == {str(one.message) for one in seen}


def test_a_warning_during_a_rewrite_is_issued_once_and_reported() -> None:
    with nengo.Network(seed=1) as network:
        for _ in range(2):
            nengo.Ensemble(5, 1, intercepts=nengo.dists.Choice([0.99]))
    with pytest.warns(UserWarning, match="larger than intercept limit") as seen:
        report = compile_network(network, pipeline="fuse").report
    texts = [str(one.message) for one in seen]
    assert sum("intercept limit" in message for message in texts) == 1
    assert set(report.warnings) == set(texts)


def test_a_warning_names_its_objects_and_is_issued_once() -> None:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        with collected_warnings() as notices:
            for name in "abcab":
                with warnings_about(f"around {name}"), warnings_about(name):
                    warnings.warn("small", stacklevel=1)
            with warnings_about("d"):
                warnings.warn("large at 0x7f00", stacklevel=1)
            warnings.warn("of none", stacklevel=1)
    expected = ("a, b, c: small", "d: large", "of none")
    assert notices.texts() == expected
    assert tuple(sorted(str(one.message) for one in seen)) == expected
    assert isinstance(warnings_about("nothing is collected"), contextlib.nullcontext)


def test_a_warning_about_many_objects_names_the_first_three() -> None:
    with nengo.Network(seed=1) as network:
        for _ in range(5):
            nengo.Ensemble(5, 1)
    with pytest.warns(UserWarning, match="initial values"):
        (warning,) = compile_network(network).report.warnings
    assert warning.startswith(
        "ensembles[0], ensembles[1], ensembles[2] and 2 more: NengoLoihi does not support initial "
    )


@pytest.mark.parametrize("passes", ["as_written", "compact"])
def test_a_warning_of_nengo_loihi_names_its_object_and_is_issued_once(passes: str) -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, label="a")
        nengo.Connection(a, a, synapse=0.1)
        nengo.Connection(a.neurons, a.neurons, transform=np.eye(10), synapse=0.02)
    with pytest.warns(UserWarning, match="initial values"):
        found = compile_network(network, pipeline=passes).report.warnings
    assert all(text.startswith(("a: ", "a -> a: ", "a -> a#2: ")) for text in found)
    assert not [text for text in found if " at 0x" in text]
    assert sum("initial values" in text for text in found) == 1
