from itertools import product

import pytest

from spikeport.robot.link.controller_states import MOVING, Event, State, after

W, Z, M, H, R, D = State
"""Wait, zero torque, ramp, hold, run, damping."""

TABLE = {
    #      observed ramped start run stop re-arm refused
    W: (Z, W, W, W, D, W, W),
    Z: (Z, Z, M, Z, D, W, Z),
    M: (M, H, M, M, D, M, D),
    H: (H, H, H, R, D, H, D),
    R: (R, R, R, R, D, R, D),
    D: (D, D, D, D, D, W, D),
}
EVENTS = (
    *(Event.OBSERVED, Event.RAMPED, Event.START, Event.RUN, Event.STOP, Event.REARM),
    Event.REFUSED,
)


@pytest.mark.parametrize(("state", "event"), list(product(State, Event)))
def test_every_event_leads_to_the_state_in_the_table(state: State, event: Event) -> None:
    assert after(state, event) is TABLE[state][EVENTS.index(event)]


def test_each_state_is_reached_only_from_itself_or_the_state_before() -> None:
    reached = {state: {after(state, event) for event in Event} for state in State}
    assert {state for state in State if R in reached[state]} == {H, R}
    assert {state for state in State if H in reached[state]} == {M, H}
    assert {state for state in State if M in reached[state]} == {Z, M}
    assert {state for state in State if Z in reached[state]} == {W, Z}


@pytest.mark.parametrize("event", [e for e in Event if e is not Event.REARM])
def test_damping_is_latched(event: Event) -> None:
    assert after(D, event) is D


@pytest.mark.parametrize("state", sorted(MOVING, key=str))
def test_a_refusal_damps_a_moving_robot(state: State) -> None:
    assert after(state, Event.REFUSED) is D
