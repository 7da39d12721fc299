"""The development environment: one package, mapped onto many top folders."""

import importlib
from pathlib import Path

import pytest

import spikeport

FOLDERS = {
    "networks": "networks",
    "compile": "compile",
    "hardware_models": "hardware_models",
    "backends": "backends",
    "robot": "robot",
    "training": "training",
    "experiments": "experiments",
    "commands": "toolchain/commands",
}


def test_the_package_itself_is_the_toolchain(root):
    assert Path(spikeport.__file__) == root / "toolchain" / "__init__.py"


@pytest.mark.parametrize(("package", "folder"), FOLDERS.items())
def test_every_subpackage_is_its_folder(root, package, folder):
    module = importlib.import_module(f"spikeport.{package}")
    assert Path(module.__file__) == root / folder / "__init__.py"


@pytest.mark.parametrize(("package", "folder"), FOLDERS.items())
def test_every_module_imports(root, package, folder):
    modules = sorted(path.stem for path in (root / folder).glob("*.py"))
    assert len(modules) > 1
    for module in set(modules) - {"__init__"}:
        importlib.import_module(f"spikeport.{package}.{module}")


def test_what_the_package_promises_is_there():
    for name in spikeport.__all__:
        assert getattr(spikeport, name).__module__.startswith("spikeport.")


def test_an_unknown_attribute_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"^module 'spikeport' has no attribute 'compiler'$"):
        _ = spikeport.compiler
