"""The public interface: the names that users import, and their texts in help()."""

import doctest
import inspect
import pydoc
import subprocess
import sys
from pathlib import Path

import pytest

import spikeport

EXPORTED = [
    "ChipImage",
    "Compilation",
    "Pipeline",
    "Simulator",
    "add_params",
    "compile_network",
    "errors",
    "set_defaults",
]


def test_dunder_all_lists_the_exported_names():
    assert spikeport.__all__ == EXPORTED


def test_dir_lists_only_the_exported_names():
    assert [name for name in dir(spikeport) if not name.startswith("_")] == EXPORTED


@pytest.mark.parametrize("name", EXPORTED)
def test_every_exported_object_has_its_name_and_a_docstring(name):
    exported = getattr(spikeport, name)
    assert exported.__name__.rpartition(".")[2] == name
    assert inspect.getdoc(exported)


def test_a_star_import_brings_all_exported_names():
    names: dict[str, object] = {}
    exec("from spikeport import *", names)
    assert set(EXPORTED) <= set(names)


def test_help_shows_the_example_the_subpackages_and_every_exported_class():
    text = pydoc.render_doc(spikeport, renderer=pydoc.plaintext)
    assert "with spikeport.Simulator(network" in text
    assert "class Simulator(" in text
    assert "class ChipImage(" in text
    assert "compile_network(" in text
    for folder in ("backends", "compile", "experiments", "hardware_models", "networks", "robot"):
        assert f"    {folder} (package)\n" in text


@pytest.mark.filterwarnings("ignore:NengoLoihi does not support initial values")
def test_the_example_runs_as_it_is_printed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # it saves an image
    assert doctest.testmod(spikeport) == (0, 8)
    assert spikeport.ChipImage.load(tmp_path / "network.npz").n_cores == 1


def test_importing_the_package_or_its_errors_imports_no_nengo():
    code = "import sys, spikeport, spikeport.errors; print('nengo' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


@pytest.fixture(scope="module")
def loaded_with_simulator() -> set[str]:
    """Return the modules that the import of `Simulator` loads, in a process of its own."""
    code = "import sys; from spikeport import Simulator; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize(
    "name",
    [
        "networkx",
        "nengo_extras",
        "numba",
        "scipy.sparse.csgraph",
        "spikeport.backends.board.chip",
        "spikeport.backends.replay",
    ],
)
def test_importing_the_simulator_does_not_import_modules_that_only_runs_need(
    name: str, loaded_with_simulator: set[str]
):
    assert {"nengo_loihi", "spikeport.backends.registry"} <= loaded_with_simulator
    assert name not in loaded_with_simulator


def test_an_unknown_attribute_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"^module 'spikeport' has no attribute 'compiler'$"):
        _ = spikeport.compiler


def test_the_citation_is_of_this_version():
    citation = (Path(__file__).parents[2] / "CITATION.cff").read_text()
    assert f"version: {spikeport.__version__}\n" in citation
