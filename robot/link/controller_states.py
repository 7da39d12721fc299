"""The states of a robot's controller, and the transitions between them."""

from enum import Enum


class State(Enum):
    """A state of a controller.

    ``WAIT``: no observation yet. ``ZERO_TORQUE``: the robot hangs loose. ``RAMP``: its joints move
    to the default pose, which they then ``HOLD``. ``RUN``: the policy commands. ``DAMPING``: all
    joints brake, until the controller is armed again.
    """

    WAIT = "wait"
    ZERO_TORQUE = "zero torque"
    RAMP = "ramp"
    HOLD = "hold"
    RUN = "run"
    DAMPING = "damping"


class Event(Enum):
    """An event that happens to a controller.

    ``OBSERVED``: a valid observation came. ``RAMPED``: the ramp is over. ``START``, ``RUN``,
    ``STOP`` and ``REARM`` come from a user. ``REFUSED``: an observation or command was refused, or
    none came.
    """

    OBSERVED = "observed"
    RAMPED = "ramped"
    START = "start"
    RUN = "run"
    STOP = "stop"
    REARM = "re-arm"
    REFUSED = "refused"


MOVING = frozenset({State.RAMP, State.HOLD, State.RUN})
"""States in which the robot is driven; in these, a refusal leads to damping."""

TRANSITIONS: dict[tuple[State, Event], State] = {
    (State.WAIT, Event.OBSERVED): State.ZERO_TORQUE,
    (State.ZERO_TORQUE, Event.START): State.RAMP,
    (State.RAMP, Event.RAMPED): State.HOLD,
    (State.HOLD, Event.RUN): State.RUN,
    **{(state, Event.STOP): State.DAMPING for state in State},
    **{(state, Event.REFUSED): State.DAMPING for state in MOVING},
    (State.ZERO_TORQUE, Event.REARM): State.WAIT,
    (State.DAMPING, Event.REARM): State.WAIT,
}
"""The next state; an event that is not in this table changes nothing."""


def after(state: State, event: Event) -> State:
    """Return the state that follows an event."""
    return TRANSITIONS.get((state, event), state)
