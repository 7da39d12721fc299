import inspect
import subprocess
import sys

import pytest
from nengo.exceptions import BuildError, ValidationError

from spikeport import errors
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.refusal import InvalidError, RefusedError

TREE = {
    "UsageError": ValueError,
    "MissingExtraError": ImportError,
    "ChipFileError": ValueError,
    "CompileError": ValueError,
    "ImageError": ValueError,
    "BackendError": RuntimeError,
    "RenderError": RuntimeError,
    "DivergedError": ArithmeticError,
}


@pytest.mark.parametrize(("name", "builtin"), TREE.items())
def test_every_error_is_ours_and_the_builtin_the_tree_says(name, builtin):
    error = getattr(errors, name)
    assert error.__bases__ == (errors.SpikeportError, builtin)
    assert f"{name} ({builtin.__name__})" in errors.__doc__


def test_the_tree_is_whole():
    found = {
        name
        for name, value in vars(errors).items()
        if inspect.isclass(value) and issubclass(value, errors.SpikeportError)
    }
    assert found == {"SpikeportError", *TREE}
    assert errors.SpikeportError.__bases__ == (Exception,)


def test_a_refused_network_is_a_compile_error_and_nengos_error():
    assert RefusedError.__bases__ == (errors.CompileError, BuildError)
    assert InvalidError.__bases__ == (RefusedError, ValidationError)
    assert DoesNotFitError.__bases__ == (RefusedError,)


def test_an_unknown_name_lists_the_known_ones_in_order():
    error = errors.unknown("chip", "lohi", ["b", "a"])
    assert type(error) is errors.UsageError
    assert str(error) == "unknown chip 'lohi'; there is: a, b"


def test_errors_are_imported_without_nengo():
    code = "import sys, spikeport.errors; sys.exit('nengo' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
