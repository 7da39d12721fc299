import inspect
import re
import site
import subprocess
import sys

import pytest
from nengo.exceptions import BuildError, ValidationError

from spikeport import errors
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.refusal import ArgumentError, InvalidError, RefusedError

TREE = {
    "UsageError": ValueError,
    "MissingExtraError": ImportError,
    "ChipFileError": ValueError,
    "NetworkError": RuntimeError,
    "CompileError": ValueError,
    "ImageError": ValueError,
    "BackendError": RuntimeError,
    "WorkerLostError": RuntimeError,
    "RenderError": RuntimeError,
    "DivergedError": ArithmeticError,
}


@pytest.mark.parametrize(("name", "builtin"), TREE.items())
def test_every_error_is_a_spikeport_error_and_the_builtin_of_the_documented_tree(name, builtin):
    error = getattr(errors, name)
    assert error.__bases__ == (errors.SpikeportError, builtin)
    assert f"{name} ({builtin.__name__})" in errors.__doc__


def test_the_tree_names_every_error_of_the_module():
    found = {
        name
        for name, value in vars(errors).items()
        if inspect.isclass(value) and issubclass(value, errors.SpikeportError)
    }
    assert found == {"SpikeportError", "BoardLostError", "RobotLostError", *TREE}
    for lost in (errors.BoardLostError, errors.RobotLostError):
        assert lost.__bases__ == (errors.BackendError,)
    assert errors.SpikeportError.__bases__ == (Exception,)


def test_refusals_are_errors_of_spikeport_and_of_nengo():
    assert RefusedError.__bases__ == (errors.CompileError, BuildError)
    assert InvalidError.__bases__ == (RefusedError, ValidationError)
    assert DoesNotFitError.__bases__ == (RefusedError,)
    assert ArgumentError.__bases__ == (errors.UsageError, ValidationError)


def test_exit_codes_are_2_for_wrong_use_and_1_for_other_errors():
    usage = {"UsageError", "ArgumentError", "MissingExtraError"}
    wrong_use = usage | {"ChipFileError", "ImageError"}
    codes = {name: getattr(errors, name).exit_code for name in errors.__all__}
    assert codes == {name: 2 if name in wrong_use else 1 for name in errors.__all__}


def test_every_error_of_the_documented_tree_can_be_imported_from_errors():
    tree = errors.__doc__.split("\n\n")[1]
    assert sorted(re.findall(r"^\W*(\w+)", tree, re.MULTILINE)) == errors.__all__
    assert set(errors.__all__) <= set(dir(errors))
    for name in errors.__all__:
        assert issubclass(getattr(errors, name), errors.SpikeportError)
    assert errors.DoesNotFitError is DoesNotFitError


def test_a_name_that_is_not_a_spikeport_error_is_an_attribute_error():
    with pytest.raises(AttributeError) as caught:
        _ = errors.ValueError
    assert str(caught.value) == "module 'spikeport.errors' has no attribute 'ValueError'"


def test_an_unknown_name_lists_the_known_ones_in_order():
    error = errors.unknown("chip", "lohi", ["b", "a"])
    assert type(error) is errors.UsageError
    assert str(error) == "unknown chip 'lohi'; choose from: a, b"


def test_nengo_is_imported_only_for_errors_that_derive_from_nengos():
    code = (
        "import sys, spikeport.errors\n"
        "from spikeport.errors import CompileError\n"
        "assert 'nengo' not in sys.modules\n"
        "from spikeport.errors import DoesNotFitError, OverBudgetError\n"
        "from spikeport.errors import ArgumentError, InvalidError, RefusedError\n"
        "assert 'nengo' in sys.modules\n"
        "from nengo.exceptions import BuildError\n"
        "assert issubclass(DoesNotFitError, BuildError)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_in_words_includes_the_notes_of_an_error():
    error = ValueError("too large")
    error.add_note("in <Node 'stim'>")
    assert errors.in_words(error) == "ValueError: too large; in <Node 'stim'>"


def test_folders_of_libraries_include_the_users_own():
    assert site.getusersitepackages() in errors.LIBRARIES
    assert set(site.getsitepackages()) <= set(errors.LIBRARIES)
