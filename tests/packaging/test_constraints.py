"""The versions in constraints.txt, compared with the requirements of the package."""

import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).parents[2]


def constraints() -> dict[str, SpecifierSet]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    found = [Requirement(line) for line in lines if not line.startswith("#")]
    return {one.name.lower(): one.specifier for one in found}


def test_constraints_allow_numpy_1_and_2() -> None:
    assert all(version in constraints()["numpy"] for version in ("1.26.4", "2.4.6"))


def test_pinned_versions_meet_the_requirements_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = (one for some in project["optional-dependencies"].values() for one in some)
    pins, compared = constraints(), 0
    for asked in map(Requirement, (*project["dependencies"], *extras)):
        for pin in pins.get(asked.name.lower(), ()):
            if pin.operator == "==":
                compared += 1
                assert pin.version in asked.specifier, asked
    assert compared > 20
