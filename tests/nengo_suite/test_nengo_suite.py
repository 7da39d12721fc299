"""Nengo's own tests pass on `spikeport.Simulator`, or are listed with a reason and fail.

A listed test also fails on nengo-loihi's simulator, with the same networks.
"""

import re
import tomllib
from collections import Counter
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.proof]

HERE = Path(__file__).parent
# Nengo's plugin does not load under pytest 9; its tests import pkg_resources.
PACKAGES = [
    "nengo==4.1.0",
    "pytest<9",
    "setuptools<81",
    "pytest-allclose",
    "pytest-plt",
    "pytest-rng",
]
SPIKEPORT = "nengo_simulator = spikeport.Simulator"
NENGO_LOIHI = "nengo_simloader = seeded.nengo_loihi_simulator"
COMPACT = "nengo_simulator = compact.Compact"
NOT_COMPACT = {
    "nengo/tests/test_connection.py::test_dist_transform",  # full weights are taken apart
    "nengo/tests/test_simulator.py::test_entry_point",  # Compact is no entry point
    "nengo/tests/test_transforms.py::test_sparse_nef[True-True]",  # what it refuses, compact builds
}
SETTINGS = """[pytest]
pythonpath = {here}
xfail_strict = true
nengo_neurons =
    nengo.LIF
    nengo.SpikingRectifiedLinear
{simulator}
nengo_test_unsupported =
{unsupported}
"""
Suite = Callable[..., dict[str, str]]


@pytest.fixture(scope="module")
def unsupported() -> dict[str, str]:
    """Return patterns of tests, and why they fail."""
    content = tomllib.loads((HERE / "unsupported.toml").read_text(encoding="utf-8"))
    return {test: one["reason"] for one in content["unsupported"] for test in one["tests"]}


@pytest.fixture(scope="module")
def suite(environment: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Suite:
    """Run Nengo's tests on a simulator; return how each ended."""
    program = environment(*PACKAGES)

    def run(simulator: str, unsupported: dict[str, str]) -> dict[str, str]:
        folder = tmp_path_factory.mktemp("suite")
        lines = "\n".join(f'    {test}\n    "{why}"' for test, why in unsupported.items())
        settings = SETTINGS.format(here=HERE, simulator=simulator, unsupported=lines)
        (folder / "pytest.ini").write_text(settings, encoding="utf-8")
        where = program("python", "-c", "import nengo; print(*nengo.__path__)", cwd=folder)
        # tests draw their seeds from their names, which begin with the package's
        root = Path(where.stdout.strip()).parent
        options = ("-c", "pytest.ini", "--rootdir", root, "--unsupported", "--junitxml", "all.xml")
        done = program(
            "pytest", *options, "-p", "no:cacheprovider", "--pyargs", "nengo", cwd=folder
        )
        assert (folder / "all.xml").exists(), done.stdout + done.stderr
        return dict(map(ended, ElementTree.parse(folder / "all.xml").iter("testcase")))

    return run


def ended(case: ElementTree.Element) -> tuple[str, str]:
    """Return the name of a test, and how it ended."""
    name = f"{case.attrib['classname'].replace('.', '/')}.py::{case.attrib['name']}"
    if case.find("failure") is not None or case.find("error") is not None:
        return name, "failed"
    skipped = case.find("skipped")
    if skipped is None:
        return name, "passed"
    return name, "failed as listed" if skipped.attrib["type"] == "pytest.xfail" else "skipped"


@pytest.fixture(scope="module")
def ours(suite: Suite, unsupported: dict[str, str]) -> dict[str, str]:
    return suite(SPIKEPORT, unsupported)


@pytest.fixture(scope="module")
def compact(suite: Suite, unsupported: dict[str, str]) -> dict[str, str]:
    return suite(COMPACT, unsupported)


@pytest.fixture(scope="module")
def theirs(suite: Suite) -> dict[str, str]:
    return suite(NENGO_LOIHI, {})


def of(outcomes: dict[str, str], how: str) -> set[str]:
    return {test for test, outcome in outcomes.items() if outcome == how}


def test_every_test_passes_or_fails_as_listed(ours: dict[str, str]) -> None:
    """A listed test that passes counts as failed: the list is strict."""
    assert of(ours, "failed") == set()
    assert Counter(ours.values()) == {"passed": 259, "failed as listed": 151, "skipped": 6}


def test_every_pattern_of_the_list_is_of_some_test(
    ours: dict[str, str], unsupported: dict[str, str]
) -> None:
    listed = of(ours, "failed as listed")
    literal = {test: "*" + re.sub(r"[][]", r"[\g<0>]", test) for test in unsupported}
    used = {test for test in unsupported if any(fnmatch(one, literal[test]) for one in listed)}
    assert set(unsupported) - used == set()


def test_what_passes_as_written_passes_rewritten(
    ours: dict[str, str], compact: dict[str, str]
) -> None:
    assert of(ours, "passed") - of(compact, "passed") == NOT_COMPACT


def test_nengo_loihi_passes_nothing_that_is_listed(
    ours: dict[str, str], theirs: dict[str, str]
) -> None:
    assert of(theirs, "passed") & of(ours, "failed as listed") == set()
    assert len(of(theirs, "passed")) > 100
