"""nengo-loihi's own tests, with the native backend compared with its emulator in every step."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytestmark = [pytest.mark.slow, pytest.mark.proof]

NEEDED = ("nengo_extras", "pytest_allclose", "pytest_plt", "pytest_rng")
MINUTES = 15


def reads_one_number_arrays() -> bool:
    try:
        float(np.ones(1))
    except TypeError:
        return False
    return True


def known_failures() -> dict[str, str]:
    """Return the tests that also fail without spikeport, and the reasons."""
    lowpass = "NumPy 2.4 refuses arrays as numbers, nengo's Lowpass.filt assigns one"
    transforms = ("True-True", "True-False", "False-True")
    known = {
        "hardware/tests/test_interface.py::test_no_warn_on_current_version": "pytest.warns(None)"
    }
    if not reads_one_number_arrays():
        test = "tests/test_connection.py::test_neurons_to_ensemble_transform"
        known |= {f"{test}[{transform}]": lowpass for transform in transforms}
    return {f"nengo_loihi/{test}": reason for test, reason in known.items()}


@pytest.fixture(scope="module")
def report(root: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"nengo-loihi's tests need {', '.join(missing)}")
    path = tmp_path_factory.mktemp("shadow") / "report.json"
    arguments = [sys.executable, "-m", "tests.shadow.run", "--report", path, "-W", "ignore"]
    done = subprocess.run(arguments, cwd=root, capture_output=True, text=True, timeout=60 * MINUTES)
    assert path.exists(), done.stdout + done.stderr
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def test_no_step_differs(report: dict[str, Any]) -> None:
    assert report["mismatches"] == []
    assert report["tests_compared"] >= 210
    assert report["steps"] > 140_000
    assert report["spikes"] > 2_000_000


def test_only_known_tests_fail(report: dict[str, Any]) -> None:
    assert set(report["tests"]["failed"]) == set(known_failures()), report["errors"]
    assert len(report["tests"]["passed"]) + len(report["tests"]["failed"]) == 476


def test_only_float_models_run_without_a_comparison(report: dict[str, Any]) -> None:
    """Other tests that compare nothing make no emulator, or do not step it."""
    assert report["not_covered"]["runs blocks of floats, which have no chip image"] == {
        "nengo_loihi/emulator/tests/test_interface.py::test_strict_mode": 2,
        "nengo_loihi/tests/test_simulator.py::test_nengo_comm_channel_compare": 1,
    }
    assert len(report["not_covered"]) == 3
