"""Schedules as text, and what is made of them."""

from collections.abc import Callable

import pytest

LINE, DIGIT, REACH, RETRACT = (
    'path = "line"',
    *(f'arm = "{goal}"' for goal in ("digit", "reach", "retract")),
)


def _phases(*goals: tuple[float, str]) -> str:
    """Phases one after the other, each of a length and a goal, named by their number."""
    begin_s, found = 0.0, []
    for number, (seconds, goal) in enumerate(goals):
        walk, draw = (0.8, 0.4) if goal.startswith("path") else (0.4, 0.8)
        found.append(
            f'[[phases]]\nname = "phase {number}"\n'
            f"begin_s = {begin_s:g}\nend_s = {begin_s + seconds:g}\n"
            f"utilities = {{ walk = {walk}, draw = {draw} }}\n{goal}\n"
        )
        begin_s += seconds
    return "\n".join(found)


@pytest.fixture(scope="session")
def phases() -> Callable[..., str]:
    """The text of a schedule."""
    return _phases


@pytest.fixture(scope="session")
def brief(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The file of a schedule of six seconds."""
    path = tmp_path_factory.mktemp("schedule") / "brief.toml"
    path.write_text(_phases((1, LINE), (2, REACH), (2, RETRACT), (1, LINE)))
    return str(path)


@pytest.fixture(scope="session")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The file of a schedule that walks for one second and draws for four."""
    path = tmp_path_factory.mktemp("schedule") / "drawn.toml"
    path.write_text(_phases((1, LINE), (4, DIGIT)))
    return str(path)
