"""The rules of docs/architecture.md on which folder may import which, compared with the code."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

EVERYONE = {
    *(
        "errors",
        "extras",
        "atomic",
        "angles",
        "arrays",
        "cache",
        "child",
        "compiled",
        "constants",
        "counted",
        "digest",
        "fault_plan",
    ),
    *("files", "freed_memory", "fresh_copy", "function_identity", "interrupts"),
    *(
        "key_values",
        "neurons",
        "node_functions",
        "pacing",
        "parts",
        "plots",
        "programs",
        "progress",
        "reading",
        "table",
    ),
}
FOLDERS: dict[str, set[str]] = {
    "networks": set(),
    "hardware_models": set(),
    "compile": {"hardware_models"},
    "backends": {"compile", "hardware_models"},
    "robot": set(),
    "training": {"robot", "networks"},
    "experiments": {
        "networks",
        "hardware_models",
        "compile",
        "backends",
        "robot",
        "training",
        "simulator",
    },
}
OF_COMPILE: dict[str, set[str]] = {
    "ground": set(),
    "image": set(),
    "placing": {"image"},
    "check": {"ground", "image", "placing"},
    "report": {"ground", "image", "check"},
    "loihi": {"ground", "image", "check"},
    "rewriting": {"ground", "loihi"},
    "passes": {"ground", "image", "placing", "loihi", "rewriting"},
    "pipeline": {
        "ground",
        "image",
        "placing",
        "check",
        "report",
        "loihi",
        "rewriting",
        "passes",
    },
}
"""The folders of compile/, lowest first: no folder imports one above it."""


def imported(path: Path) -> Iterator[str]:
    """Yield the dotted names that a file imports, within functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def reached(files: list[Path], package: str) -> set[tuple[str, str]]:
    """Return what files import of a package: pairs of file and folder or module in it."""
    depth = package.count(".") + 1
    return {
        (str(path), name.split(".")[depth])
        for path in files
        for name in imported(path)
        if name.startswith(f"{package}.")
    }


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_folder_imports_only_from_allowed_folders(root: Path, folder: str) -> None:
    allowed = {folder} | FOLDERS[folder] | EVERYONE
    found = reached(sorted((root / folder).rglob("*.py")), "spikeport")
    assert {(file, other) for file, other in found if other not in allowed} == set()


def files_of(root: Path, folder: str) -> list[Path]:
    single = root / "compile" / f"{folder}.py"
    return [single] if single.exists() else sorted((root / "compile" / folder).rglob("*.py"))


@pytest.mark.parametrize("folder", OF_COMPILE)
def test_a_folder_of_compile_imports_only_from_allowed_folders(root: Path, folder: str) -> None:
    found = reached(files_of(root, folder), "spikeport.compile")
    assert {
        (file, other) for file, other in found if other not in {folder} | OF_COMPILE[folder]
    } == set()


def test_no_folder_of_compile_may_import_one_above_it(root: Path) -> None:
    below: set[str] = set()
    for folder, allowed in OF_COMPILE.items():
        assert allowed <= below
        below.add(folder)
    folders = {path.stem for path in (root / "compile").iterdir() if path.name[0] not in "_."}
    assert folders == set(OF_COMPILE)


def test_the_robot_imports_nothing_of_its_link(root: Path) -> None:
    link = root / "robot" / "link"
    files = [path for path in (root / "robot").rglob("*.py") if link not in path.parents]
    assert {file for file, folder in reached(files, "spikeport.robot") if folder == "link"} == set()


def test_only_one_folder_builds_with_nengo_loihi(root: Path) -> None:
    files = [f for folder in OF_COMPILE if folder != "loihi" for f in files_of(root, folder)]
    found = {file for file, part in reached(files, "nengo_loihi") if part == "builder"}
    assert found == {str(root / "compile" / "pipeline.py")}  # the type of `Compilation.model`


def test_the_image_and_its_kernels_need_no_nengo(root: Path) -> None:
    files = [*files_of(root, "image"), *(root / "backends" / "native").glob("*.py")]
    names = {name.split(".")[0] for path in files for name in imported(path)}
    assert names & {"nengo", "nengo_loihi", "nengo_spa"} == set()
    native = reached(files, "spikeport.compile")
    assert {folder for _, folder in native} == {"image"}


def test_only_the_engine_imports_mujoco_itself(root: Path) -> None:
    """The engine turns what goes wrong there into errors that say how to go on."""
    folders = [*FOLDERS, "src"]
    files = [path for folder in folders for path in (root / folder).rglob("*.py")]
    found = {str(path.relative_to(root)) for path in files if "mujoco" in imported(path)}
    assert found == {"robot/engine.py"}
