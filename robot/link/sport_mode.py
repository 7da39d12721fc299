"""The release of sport mode, which would otherwise command the same motors.

The motion switcher is asked for the mode's name (1001) and to release the mode (1003), until the
name is empty. Source: unitree_sdk2 ``example/h1/low_level/humanoid.hpp``, unitree_sdk2_python
``motion_switcher_client.py``.
"""

import json
from collections.abc import Callable
from typing import NamedTuple

from spikeport.errors import BackendError
from spikeport.robot.link.settings import is_mode_name

CHECK_MODE, RELEASE_MODE = 1001, 1003
"""Functions of the motion switcher."""
EMPTY = json.dumps({})
"""The parameter of both functions."""
MOST_RELEASES = 5


class Answer(NamedTuple):
    """An answer of the switcher: 0 or the code of an error, and data as JSON."""

    code: int
    data: str


class SportModeRelease:
    """The sequence of requests: check, and release as long as there is a mode.

    Parameters
    ----------
    request : callable
        Sends a function's number and a parameter, and returns the switcher's answer.

    Attributes
    ----------
    released : bool
        True if there is no mode any more.
    mode : str
        The mode's name at the last check.
    """

    def __init__(self, request: Callable[[int, str], Answer]) -> None:
        self._request = request
        self.released, self.mode = False, ""
        self._releases = 0

    def step(self) -> None:
        """Check the mode, and release it if there is one; a robot needs seconds to leave it.

        Raises
        ------
        BackendError
            If the switcher answers with an error or with an invalid mode, or if there still is a
            mode after `MOST_RELEASES` releases.
        """
        self.mode = _mode(self._asked("CheckMode", CHECK_MODE).data)
        self.released = not self.mode
        if self.released:
            return
        # Something switches the mode back, so further releases would never end.
        if self._releases == MOST_RELEASES:
            raise BackendError(
                f"the robot is still in mode '{self.mode}' after {MOST_RELEASES} releases; stop "
                "the running program with the robot's remote or app, then start again"
            )
        self._releases += 1
        self._asked("ReleaseMode", RELEASE_MODE)

    def _asked(self, name: str, number: int) -> Answer:
        answer = self._request(number, EMPTY)
        if answer.code:
            raise BackendError(
                f"the motion switcher answered {name} with error {answer.code}; is the robot up, "
                "and is no other program switching its mode?"
            )
        return answer


def _mode(data: str) -> str:
    """Return the mode's name in the answer to a check, ``{"form": "0", "name": "..."}``."""
    try:
        name = json.loads(data)["name"]
    except (ValueError, TypeError, KeyError, RecursionError):
        name = None
    if not (isinstance(name, str) and is_mode_name(name)):
        raise BackendError(
            f"the motion switcher answered CheckMode with {data[:80]!a}, which is not a mode's name"
        )
    return name
