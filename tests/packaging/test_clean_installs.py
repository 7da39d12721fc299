"""The wheel in a clean environment of the newest Python, which compiles the same image.

The oldest one, with NumPy 1, is tested in `test_wheel`.
"""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from spikeport.compile.pipeline import compile_network
from spikeport.find_network import find_network
from tests.packaging.test_wheel import NETWORK

pytestmark = pytest.mark.slow


def python_of(version: str) -> Path:
    """Return a Python of a version from the path or pyenv, or skip the test."""
    pyenv = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python"))
    for python in (shutil.which(f"python{version}"), *pyenv):
        # pyenv has shims for every version, which fail unless the version is selected.
        if python and subprocess.run([python, "-c", ""], capture_output=True).returncode == 0:
            return Path(python)
    pytest.skip(f"Python {version} is absent")


def test_a_clean_install_in_the_newest_python_compiles_the_same_image(
    environment: Callable[..., Any], tmp_path: Path
) -> None:
    run = environment(numpy=["numpy>=2"], python=python_of("3.13"))
    (tmp_path / "net.py").write_text(NETWORK, encoding="utf-8")
    done = run("spikeport", "compile", "net.py:make", "--json", "report.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    ours = compile_network(find_network(f"{tmp_path}/net.py:make", [])).image
    assert json.loads((tmp_path / "report.json").read_text())["image_digest"] == ours.digest
    assert run("spikeport", "doctor", cwd=tmp_path).returncode == 0
