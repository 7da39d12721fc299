"""The development environment: one tree, in which links lead to the top folders."""

import importlib
import os
import pkgutil
from pathlib import Path

import pytest

import spikeport

LINKED = (
    "backends",
    "compile",
    "experiments",
    "hardware_models",
    "networks",
    "robot",
    "training",
)
MODULES = [module.name for module in pkgutil.walk_packages(spikeport.__path__, "spikeport.")]


def test_the_package_is_a_plain_folder_of_the_checkout(root):
    assert Path(spikeport.__file__) == root / "src" / "spikeport" / "__init__.py"


@pytest.mark.parametrize("folder", LINKED)
def test_every_top_folder_is_linked_into_the_package(root, folder):
    link = root / "src" / "spikeport" / folder
    assert os.readlink(link) == f"../../{folder}"
    assert (link / "__init__.py").is_file()


def test_no_module_of_a_top_folder_is_left_out_of_the_package(root):
    for folder in LINKED:
        for path in (root / folder).rglob("*.py"):
            parts = path.relative_to(root).with_suffix("").parts
            name = ".".join(("spikeport", *parts)).removesuffix(".__init__")
            assert name in MODULES


@pytest.mark.parametrize("module", MODULES)
def test_every_module_imports(module):
    importlib.import_module(module)
