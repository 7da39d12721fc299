"""Lines for screen and figure about a run's links: to its board, and to its robot."""

from collections.abc import Mapping
from typing import Any


def link_line(link: Mapping[str, Any]) -> str:
    """Return a line about a run's link to a board: round trips, held steps and late steps."""
    # A record that is played back has no round trips.
    if "round_trip_us" not in link:
        return f"replayed: {link['replays']}"
    trips = {
        name: "-" if us is None else f"{us:,.0f}" for name, us in link["round_trip_us"].items()
    }
    clock = "real time" if link["real_time"] else "simulated time"
    return (
        f"board ({link['runs']}, {clock}): round trip {trips['median']} us, p99 {trips['p99']}, "
        f"worst {trips['worst']}; {link['held']:,} of {link['steps']:,} steps held, "
        f"{link['overruns']:,} began late"
    )


def robot_line(robot: Mapping[str, Any]) -> str:
    """Return a line about the robot behind its interface."""
    itself = robot["robot"] if isinstance(robot.get("robot"), dict) else {}
    trips, late = robot.get("round_trip_us", {}), f"{robot['overruns']:,} steps began late"
    parts = [
        f"{robot['states']:,} states, {robot['held']:,} held, {late}",
        f"round trip {trips['median']:,.0f} us" if trips.get("median") else "",
        f"motion {itself['motion']}" if itself else "",
        _estimator_line(robot["estimator"]),
    ]
    return "robot: " + "; ".join(part for part in parts if part)


def _estimator_line(estimator: Mapping[str, Any]) -> str:
    """Return the name of the robot's estimator of motion, and its error if that is known."""
    name, error = f"estimator {estimator['name']}", estimator["velocity_error_m_s"]
    if error is not None:
        velocity, place_m = ", ".join(f"{e:.3f}" for e in error), estimator["place_error_m"]
        return f"{name}, off by {velocity} m/s and {place_m:.2f} m"
    # Without a truth to compare with, only the estimator's own deviation is known.
    deviation_m = estimator["place_deviation_m"]
    return f"{name}, own estimate of its error {deviation_m:.2f} m" if deviation_m else name
