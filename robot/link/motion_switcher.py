"""The motion switcher over DDS: a controller's client, and the service of a simulated robot.

Sport mode and our controller would both command the robot if sport mode were not released first.
"""

import itertools
import json
import time
from typing import TYPE_CHECKING

from spikeport.errors import BackendError
from spikeport.robot.link.messages import SWITCHER_REQUESTS, SWITCHER_RESPONSES
from spikeport.robot.link.requests import (
    Request,
    Response,
    decode_request,
    decode_response,
    encode_request,
    encode_response,
)
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.sport_mode import CHECK_MODE, RELEASE_MODE, Answer, SportModeRelease
from spikeport.robot.link.wire import MessageError

if TYPE_CHECKING:
    from spikeport.robot.link.bus import Bus

FOUND_S = 5.0
"""Time in which a switcher must be found, once its robot is found."""
ANSWERS_S = 10.0
"""Time in which a switcher must answer."""
PAUSE_S = 1.0
"""Time that a robot has to leave its mode, before it is checked again."""
SLICE_S = 0.02
UNKNOWN_FUNCTION = 3203
"""Unitree's code of a function that a service does not have."""


class MotionSwitcher:
    """A robot's motion switcher, for a controller.

    Parameters
    ----------
    bus : Bus
        The bus of the robot.
    required : bool
        True if a robot without a switcher is refused, as where robots may be real.
    """

    def __init__(self, bus: "Bus", required: bool) -> None:
        self._requests = bus.writer(SWITCHER_REQUESTS)
        self._responses = bus.reader(SWITCHER_RESPONSES, reliable=True)
        self._required = required
        # The first number is the time, so that answers to an earlier controller never match.
        self._numbers = itertools.count(time.time_ns())

    def release(self) -> list[str] | None:
        """Release sport mode, and return the modes that were released; None without a switcher.

        Raises
        ------
        BackendError
            If a switcher is required and there is none, or it does not release.
        """
        if not self._is_there():
            return None
        release = SportModeRelease(self.ask)
        modes: list[str] = []
        while True:
            release.step()
            if release.released:
                return modes
            modes.append(release.mode)
            time.sleep(PAUSE_S)

    def _is_there(self) -> bool:
        """Return whether a motion switcher is there, within `FOUND_S`."""
        until = time.monotonic() + FOUND_S
        while time.monotonic() < until:
            # Both: DDS finds ends one by one, and a request is lost until its reader is found.
            if self._requests.n_readers and self._responses.writers:
                return True
            time.sleep(SLICE_S)
        if self._required:
            raise BackendError(
                f"no motion switcher within {FOUND_S:g} s: a robot in sport mode would be "
                "commanded twice, so nothing was sent; is the robot up?"
            )
        return False

    def ask(self, function: int, parameter: str) -> Answer:
        """Send a request, and return its answer; raises BackendError if none comes."""
        number = next(self._numbers)
        self._requests.write(encode_request(Request(number, function, parameter)))
        until = time.monotonic() + ANSWERS_S
        while (left := until - time.monotonic()) > 0:
            # In slices, since an interrupt does not end a wait of DDS.
            for arrival in self._responses.take(min(left, SLICE_S)):
                try:
                    found = decode_response(arrival.message)
                except MessageError:
                    continue
                if (found.number, found.function) == (number, function):
                    return Answer(found.code, found.data)
        raise BackendError(
            f"the motion switcher did not answer within {ANSWERS_S:g} s; is the robot up?"
        )


class SwitcherService:
    """The motion switcher of a simulated robot.

    Parameters
    ----------
    bus : Bus
        The bus of the robot.
    robot : SimulatedRobot
        The robot, whose sport mode it releases.
    """

    def __init__(self, bus: "Bus", robot: SimulatedRobot) -> None:
        self._requests = bus.reader(SWITCHER_REQUESTS, reliable=True)
        self._responses = bus.writer(SWITCHER_RESPONSES)
        self._robot = robot

    def serve(self) -> None:
        """Answer the requests since the last call."""
        for arrival in self._requests.take():
            try:
                request = decode_request(arrival.message)
            except MessageError:
                continue
            code, data = self._answer(request.function)
            answer = Response(request.number, request.function, code, data)
            self._responses.write(encode_response(answer))

    def _answer(self, function: int) -> Answer:
        if function == CHECK_MODE:
            return Answer(0, json.dumps({"form": "0", "name": self._robot.sport_mode}))
        if function == RELEASE_MODE:
            self._robot.sport_mode = ""
            return Answer(0, "")
        return Answer(UNKNOWN_FUNCTION, "")
