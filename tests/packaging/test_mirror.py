"""The places of tests: each module has a test at its own path, or a reason for having none.

The test of ``compile/placing/packing.py`` is ``tests/compile/placing/test_packing.py``, that of
``src/spikeport/cli.py`` is ``tests/spikeport/test_cli.py``. A folder of tests may also hold tests
of several modules together.
"""

from collections import Counter
from pathlib import Path

import pytest

OTHERS = {"benchmarks", "docs", "examples", "fuzz", "helpers", "nengo_suite", "packaging", "shadow"}
"""Folders of tests that mirror no folder of the package."""

TYPES = {
    "backends/chip.py",
    "backends/execution.py",
    "compile/passes/base.py",
    "robot/engine.py",
    "robot/estimator/base.py",
    "robot/signals.py",
    "robot/times.py",
    "spikeport/constants.py",
}
"""Modules that only declare: protocols, bases, types, constants, an import."""

IN_RUNS = {
    "experiments/arm/settings.py",
    "experiments/arm/trial.py",
    "experiments/driver.py",
    "experiments/evaluate/episode.py",
    "experiments/evaluate/figure.py",
    "experiments/evaluate/stage.py",
    "experiments/policy/trial.py",
    "experiments/switch/controller.py",
    "experiments/switch/figure.py",
    "experiments/switch/settings.py",
    "experiments/walk/controller.py",
    "experiments/walk/settings.py",
}
"""Modules of experiments that have no test but runs of the experiment: `test_trial`, `test_reach`,
`test_draw`, and of evaluations: `test_evaluate`."""

ELSEWHERE = {
    "backends/board/link.py": "backends/board/test_opening.py",
    "backends/softcore/simulation.py": "backends/softcore/test_chip.py",
    "spikeport/cli_experiments.py": "spikeport/test_cli.py",
    "spikeport/cli_networks.py": "spikeport/test_cli.py",
    "spikeport/commands/options_of_experiments.py": "spikeport/commands/test_figure.py",
    "spikeport/commands/options_of_links.py": "spikeport/commands/test_links.py",
    "networks/spa_selection.py": "networks/test_action_selection.py",
    "training/export.py": "training/test_networks.py",
}
"""Modules that the test of another module covers, and this test."""


@pytest.fixture(scope="module")
def modules(root: Path) -> set[str]:
    """Return the modules, by their path within the folder that tests mirror."""
    package = root / "src" / "spikeport"
    links = [path for path in package.iterdir() if path.is_symlink()]
    trees = [(root, root / link.name) for link in links] + [(package.parent, package)]
    found = {
        path.relative_to(base).as_posix()
        for base, folder in trees
        for path in folder.rglob("*.py")
        if not any(parent in links for parent in path.parents)
    }
    return {name for name in found if not name.endswith("__init__.py")}


@pytest.fixture(scope="module")
def tests(root: Path) -> set[str]:
    """Return the files with tests, by their path within the folder of tests."""
    folder = root / "tests"
    return {path.relative_to(folder).as_posix() for path in folder.rglob("test_*.py")}


def mirrored(module: str) -> str:
    """Return the path of a module's test."""
    folder, _, name = module.rpartition("/")
    return f"{folder}/test_{name}"


def test_a_test_named_after_a_module_lies_where_the_module_does(
    modules: set[str], tests: set[str]
) -> None:
    names = Counter(module.rpartition("/")[2] for module in modules)
    paths = {mirrored(module) for module in modules}
    astray = {
        test
        for test in tests - paths
        if test.partition("/")[0] not in OTHERS
        and names[test.rpartition("/")[2].removeprefix("test_")] == 1
    }
    assert astray == set()


def test_every_folder_of_tests_mirrors_one_of_the_package(
    modules: set[str], tests: set[str]
) -> None:
    mirrors = {module.rpartition("/")[0] for module in modules}
    folders = {test.rpartition("/")[0] for test in tests}
    assert {folder for folder in folders if folder.partition("/")[0] not in OTHERS} <= mirrors


def test_a_module_has_a_test_at_its_path_or_a_reason_for_none(
    modules: set[str], tests: set[str]
) -> None:
    without = {module for module in modules if mirrored(module) not in tests}
    assert without == TYPES | IN_RUNS | set(ELSEWHERE)


@pytest.mark.parametrize(("module", "test"), ELSEWHERE.items())
def test_a_module_without_a_test_of_its_own_is_imported_by_the_test_of_another(
    root: Path, module: str, test: str
) -> None:
    dotted = module.removesuffix(".py").replace("/", ".")
    dotted = dotted if dotted.startswith("spikeport.") else f"spikeport.{dotted}"
    package, _, name = dotted.rpartition(".")
    text = (root / "tests" / test).read_text(encoding="utf-8")
    assert dotted in text or f"from {package} import {name}" in text


def test_every_folder_of_tests_is_a_package(root: Path) -> None:
    folders = {path.parent for path in (root / "tests").rglob("*.py")}
    assert {str(folder) for folder in folders if not (folder / "__init__.py").is_file()} == set()
