"""A robot's controller as a state machine, without a bus and without a clock of its own.

Every step has one command, whatever the state, so the robot's watchdog never trips while the
controller is there. The caller passes the time. The link (`over_dds`) checks messages,
calls `answer` for the messages that it trusts, and `refuse` for others.
"""

import math
from collections.abc import Callable

import numpy as np

from spikeport.robot.description import JOINTS, KD, KP, POSE_RAD
from spikeport.robot.link.admission import LATEST_S, too_old
from spikeport.robot.link.controller_states import MOVING, Event, State, after
from spikeport.robot.link.h1 import DAMPING, ZERO_TORQUE, check_commands
from spikeport.robot.link.remote import decode, pressed
from spikeport.robot.link.wire import MessageError
from spikeport.robot.signals import MotorCommands, Sensors

RAMP_S = 2.0
"""Time in which the joints move to the default pose. Source: unitree_rl_gym, ``deploy_real.py``."""

_NONE = np.zeros(len(JOINTS))
HOLD = MotorCommands(POSE_RAD, _NONE, KP, KD, _NONE)
"""The command that holds the default pose."""


class Controller:
    """Controller that answers a robot's states by commands.

    Parameters
    ----------
    policy : callable
        Returns the commands for an observation; called only if the state is ``RUN``.

    Attributes
    ----------
    state : State
        The present state.
    refused : str
        The reason of the last refusal of an observation or command; empty if there was none.
    damped_for : str
        The reason of the last damping; empty if the user stopped the robot.
    refusals : int
        The number of refusals.
    """

    def __init__(self, policy: Callable[[Sensors], MotorCommands]) -> None:
        self._policy = policy
        self.state, self.refused, self.refusals = State.WAIT, "", 0
        self.damped_for = ""
        self._entered, self._sent = False, ZERO_TORQUE
        self._ramp_from_rad, self._ramp_since_s = HOLD.q, 0.0
        self._last_time_s, self._last_s = -math.inf, 0.0
        self._anew = False
        self._keys: frozenset[str] | None = None

    def answer(self, sensors: Sensors, remote: bytes, now_s: float) -> MotorCommands:
        """Return the command that answers an observation.

        An observation that is no newer than the last one gets the same answer.

        Parameters
        ----------
        sensors : Sensors
            The observation.
        remote : bytes
            The 40 bytes of the wireless remote; empty where there is none.
        now_s : float
            Time from any origin, s.
        """
        self.watch(now_s)
        # A robot that was switched on again counts from 0, but one that is silent is not heard.
        if sensors.time_s > self._last_time_s or (
            self._anew and sensors.time_s != self._last_time_s
        ):
            self._anew = False
            self._last_time_s, self._last_s = sensors.time_s, now_s
            self.happen(Event.OBSERVED)
            self._take_remote(remote)
            self._sent = self._command(sensors, now_s)
        return self._sent

    def watch(self, now_s: float) -> bool:
        """Damp a moving robot whose last valid observation is too old; returns True if it did.

        After True, the command to send is `DAMPING`.
        """
        age_s, most_s = now_s - self._last_s, LATEST_S
        if self.state not in MOVING or age_s <= most_s:
            return False
        self.refuse(too_old(age_s, most_s))
        return True

    def refuse(self, reason: str) -> None:
        """Count a refusal, and damp a moving robot."""
        self.refused, self.refusals = reason, self.refusals + 1
        self.happen(Event.REFUSED, reason)

    def happen(self, event: Event, reason: str = "") -> None:
        """Handle an event, of the user or of the observations; ``reason`` explains a refusal."""
        before, self.state = self.state, after(self.state, event)
        if self.state is before:
            return
        self._entered = True
        if self.state is State.DAMPING:
            self.damped_for = reason
        if self.state is State.WAIT:
            self._anew, self._keys = True, None
        if self.state not in MOVING:
            self._sent = self._at_rest()  # sent even if no newer observation comes

    def _take_remote(self, message: bytes) -> None:
        """Handle the keys that went down since the last message."""
        if not message:
            return
        now = decode(message)
        # Keys that are down in the first message were not pressed for this controller.
        before, self._keys = now if self._keys is None else self._keys, now
        for event in pressed(before, now):
            self.happen(event)

    def _at_rest(self) -> MotorCommands:
        """Return the command of a state that needs no observation."""
        return DAMPING if self.state is State.DAMPING else ZERO_TORQUE

    def _command(self, sensors: Sensors, now_s: float) -> MotorCommands:
        """Return the command of the present state."""
        entered, self._entered = self._entered, False
        if self.state not in MOVING:
            return self._at_rest()
        if self.state is State.RUN:
            return self._run(sensors)
        if entered and self.state is State.RAMP:
            # The ramp begins where the joints are, so that its first command moves nothing.
            self._ramp_from_rad, self._ramp_since_s = sensors.q, now_s
        return self._ramp(now_s)

    def _ramp(self, now_s: float) -> MotorCommands:
        """Return the way to the default pose: q = q_0 + s (pose - q_0), s from 0 to 1."""
        share = min((now_s - self._ramp_since_s) / RAMP_S, 1.0)
        if share == 1.0:
            self.happen(Event.RAMPED)
        begun = self._ramp_from_rad
        return HOLD._replace(q=begun + share * (POSE_RAD - begun))

    def _run(self, sensors: Sensors) -> MotorCommands:
        """Return the policy's command; damp the robot if motors must not obey it."""
        commands = self._policy(sensors)
        try:
            check_commands(commands)
        except MessageError as error:
            self.refuse(f"a command of the policy: {error}")
            return self._at_rest()
        return commands
