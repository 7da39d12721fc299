"""Schedules as text, and made-up runs."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.experiments.arm import digit_reader
from spikeport.experiments.arm.draw_task import DrawTask
from spikeport.experiments.switch.goals import Goal, hanging_hand
from spikeport.experiments.switch.schedule import Phase

SECONDS, DT_S = 6.0, 0.005
DRAW = {"walk": 0.4, "draw": 0.8}
LINE, DIGIT, REACH, RETRACT = (
    'path = "line"',
    *(f'arm = "{goal}"' for goal in ("digit", "reach", "retract")),
)


def _phases(*goals: tuple[float, str]) -> str:
    """Return consecutive phases, each with a length and a goal, named by their number."""
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
    """Return a function that writes the text of a schedule."""
    return _phases


@pytest.fixture(scope="session")
def brief(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the file of a schedule of six seconds."""
    path = tmp_path_factory.mktemp("schedule") / "brief.toml"
    path.write_text(_phases((1, LINE), (2, REACH), (2, RETRACT), (1, LINE)))
    return str(path)


@pytest.fixture(scope="session")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the file of a schedule that walks for one second and draws for four."""
    path = tmp_path_factory.mktemp("schedule") / "drawn.toml"
    path.write_text(_phases((1, LINE), (4, DIGIT)))
    return str(path)


@pytest.fixture
def worked(monkeypatch: pytest.MonkeyPatch) -> Callable[..., SimpleNamespace]:
    """Return a function that makes a run of 6 s of the arm; its drawing is read as ``read_as``."""

    def make(arm, off_m=0.0, read_as=None, anchored=True, jumps=0, switch_s=0.03, fallen_at_s=None):
        monkeypatch.setattr(digit_reader, "can_read", lambda: read_as is not None)
        monkeypatch.setattr(digit_reader, "read_digit", lambda _trace: read_as)
        phase = Phase(name="work", begin_s=0, end_s=SECONDS, utilities=DRAW, arm=arm)
        goal = Goal(phase, None, digit=8, seed=(0, 0))
        time_s = DT_S * np.arange(1, 1 + round(SECONDS / DT_S))
        share = np.clip((time_s - DrawTask.begin_s) / (SECONDS - DrawTask.begin_s), 0, 1)
        on_sheet = goal.stroke[(share * (len(goal.stroke) - 1)).astype(int)]
        late = np.arange(round(SECONDS * 1000)) >= round(1000 * switch_s)
        off = np.array([off_m, 0, 0])
        # For a second, the hand is still 1 m away.
        hand = hanging_hand() + np.outer(np.where(time_s < 1, 1.0, off_m), [1, 0, 0])
        target = np.outer(np.arange(len(time_s)) * (1 + jumps) // len(time_s), [0.1, 0, 0])
        return SimpleNamespace(
            goals=[goal],
            paths=[None],
            recording=SimpleNamespace(time_s=time_s, position_m=np.zeros((len(time_s), 2))),
            arm=SimpleNamespace(hand=hand, target=target),
            local_m=on_sheet + off,
            gates=np.stack([~late, late], axis=1).astype(float),
            spikes={},
            fallen_at_s=fallen_at_s,
            anchored=anchored,
        )

    return make
