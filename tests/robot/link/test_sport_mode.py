import json

import pytest

from spikeport.errors import BackendError
from spikeport.robot.link.sport_mode import (
    CHECK_MODE,
    EMPTY,
    MOST_RELEASES,
    RELEASE_MODE,
    Answer,
    SportModeRelease,
)


class Switcher:
    """A motion switcher that leaves its mode after some releases, and records the requests."""

    def __init__(self, releases: int, name: str = "ai") -> None:
        self.releases, self.name = releases, name
        self.asked: list[int] = []

    def __call__(self, number: int, parameter: str) -> Answer:
        assert parameter == EMPTY
        self.asked.append(number)
        if number == RELEASE_MODE:
            self.releases -= 1
            return Answer(0, "")
        name = self.name if self.releases > 0 else ""
        return Answer(0, json.dumps({"form": "0", "name": name}))


def test_a_robot_without_a_mode_is_only_checked():
    switcher = Switcher(0)
    release = SportModeRelease(switcher)
    release.step()
    assert release.released
    assert switcher.asked == [CHECK_MODE]


@pytest.mark.parametrize("releases", [1, 2, MOST_RELEASES])
def test_a_mode_is_released_until_its_name_is_empty(releases):
    switcher = Switcher(releases)
    release = SportModeRelease(switcher)
    for _ in range(releases):
        release.step()
        assert not release.released
        assert release.mode == "ai"
    release.step()
    assert release.released
    assert release.mode == ""
    assert switcher.asked == [*releases * (CHECK_MODE, RELEASE_MODE), CHECK_MODE]


def test_a_mode_that_stays_is_an_error():
    release = SportModeRelease(Switcher(100, "normal"))
    for _ in range(MOST_RELEASES):
        release.step()
    with pytest.raises(BackendError, match=r"mode 'normal' after 5 releases.*remote"):
        release.step()


@pytest.mark.parametrize(
    ("failing", "name"), [(CHECK_MODE, "CheckMode"), (RELEASE_MODE, "Release")]
)
def test_an_error_code_of_the_switcher_is_raised_with_its_function(failing, name):
    good = Switcher(1)

    def answer(number: int, parameter: str) -> Answer:
        return Answer(7002, "") if number == failing else good(number, parameter)

    with pytest.raises(BackendError, match=rf"{name}.* error 7002"):
        SportModeRelease(answer).step()


@pytest.mark.parametrize(
    "data",
    [
        *("", "null", "[]", "{", '{"name": 1}', '{"form": "0"}', '"name"', "[" * 10_000),
        *(json.dumps({"name": name}) for name in ("x" * 1000, "\x1b[2J", "\n", "é")),
    ],
)
def test_an_answer_that_is_not_a_mode_is_an_error(data):
    with pytest.raises(BackendError, match="which is not a mode's name"):
        SportModeRelease(lambda *_: Answer(0, data)).step()
