"""The robot's motion by an estimator, and its errors if the truth is published."""

from typing import Protocol

import numpy as np

from spikeport.angles import wrap
from spikeport.errors import RobotLostError
from spikeport.robot.estimator.base import Fix, StateEstimator
from spikeport.robot.estimator.registry import BY_ODOMETRY, BY_SENSORS, TRUTH, check_estimator
from spikeport.robot.estimator.truth import Truth
from spikeport.robot.link.admission import LATEST_S
from spikeport.robot.link.client import Observed
from spikeport.robot.link.codec import TICK_S
from spikeport.robot.link.messages import ODOMETRY, TRUTHS, Topic
from spikeport.robot.link.odometer import OdometryFixes
from spikeport.robot.link.truth import true_state
from spikeport.robot.signals import Sensors
from spikeport.robot.state import RobotState, in_plane

ESTIMATE, BOTH = "estimate", "both"
"""The motions that a run may have recorded, besides `TRUTH`."""
ROUNDING = 1e-6
"""The rounding error, in m or rad, of a pose at the origin, by an estimate or in a message."""


class MotionSource(Protocol):
    """Motion of a robot, estimated observation by observation.

    Attributes
    ----------
    true : RobotState or None
        The true motion now, if a simulation publishes it and the motion is estimated.
    """

    true: RobotState | None

    def __call__(self, observed: Observed) -> RobotState:
        """Return the motion at the next observation."""

    def summary(self) -> dict[str, object]:
        """Return the figures for a run's ``result.json``."""


class EstimatedMotion:
    """The motion of a robot by an estimator, which starts at the first observation.

    Parameters
    ----------
    name : str
        One of the names in `registry.ESTIMATORS`.
    held : Fix or None
        The place where a hoist holds the pelvis, used as a fix at every observation.

    Attributes
    ----------
    true : RobotState or None
        The true motion now, if a simulation publishes it and the motion is estimated.

    Raises
    ------
    UsageError
        If the estimator is not known.
    """

    _observed: Observed
    _found: RobotState

    def __init__(self, name: str, held: Fix | None = None) -> None:
        check_estimator(name)
        self._name, self._held = name, held
        self._estimator: StateEstimator = (
            # A function, as there is no observation yet.
            Truth(lambda: true_state(self._observed)) if name == TRUTH else BY_SENSORS[name]()
        )
        self._begun = False
        self._fixes = OdometryFixes() if name in BY_ODOMETRY else None
        self._comparison = Comparison()
        self.true: RobotState | None = None

    def __call__(self, observed: Observed) -> RobotState:
        """Return the motion at the next observation.

        Raises
        ------
        RobotLostError
            If the motion is the truth or by odometry, and nobody publishes that, or if the first
            odometry has no orientation.
        """
        if self._begun and observed.tick == self._observed.tick:
            return self._found  # it was held, so nothing is new
        earlier = self._observed if self._begun else None
        self._observed = observed
        sensors, fix = observed.sensors, self._fix(observed)
        if earlier is None:
            self._found = self._estimator.reset(sensors, fix)
        else:
            self._found = self._estimator.update(sensors, fix, _between(earlier, observed))
        self._begun = True
        if self._name != TRUTH:
            self.true = self._comparison.with_truth(self._found, observed)
        return self._found

    def _fix(self, observed: Observed) -> Fix | None:
        """Return the fix of the pelvis: by its hoist, else by odometry."""
        if self._held is not None or self._fixes is None:
            return self._held
        if observed.odometry is None:
            raise RobotLostError(
                "the robot publishes no odometry; give --estimator ekf, or serve a simulation with "
                "--odometer"
            )
        return self._fixes.fix(observed.odometry, observed.sensors)

    def summary(self) -> dict[str, object]:
        """Return the estimator's name and its errors; unknown errors are None.

        ``velocity_error_m_s`` is the rms along the pelvis' x, y and z; ``place_error_m`` and
        ``heading_error_rad`` are the distance from the true place in the plane, and from the true
        heading, at the last observation with a truth. ``place_deviation_m`` is the place error that
        the estimator itself expects. ``recorded`` says which motion of the run is recorded: the
        true one, the estimate, or both, if the truth was published for a part of the run.
        """
        return {
            "name": self._name,
            **self._comparison.errors(),
            "place_deviation_m": self._estimator.place_deviation_m if self._begun else None,
            "recorded": TRUTH if self._name == TRUTH else self._comparison.recorded,
        }


def _between(last: Observed, now: Observed) -> list[Sensors]:
    """Return the sensors of the states between two observations; a state may have come again."""
    found, last_s = [], last.sensors.time_s
    for sensors in now.between:
        if last_s < sensors.time_s < now.sensors.time_s:
            found.append(sensors)
            last_s = sensors.time_s
    return found


class Comparison:
    """The comparison of estimated motions with true ones, where a simulation publishes these."""

    def __init__(self) -> None:
        self._squares, self._compared = np.zeros(3), 0
        # The numbers of observations, and of those with a truth; both motions at the last of these.
        self._seen = self._judged = 0
        self._last: tuple[RobotState, RobotState] | None = None
        self._moved_m = np.zeros(3)

    def with_truth(self, found: RobotState, observed: Observed) -> RobotState | None:
        """Compare an estimate at an observation; return the true motion, or None if there is none.

        Velocities are compared only at equal ticks. The true place counts from the first
        observation, as the estimate's does: a served robot may have walked before.
        """
        self._seen += 1
        if observed.truth is None or not _is_current(observed.truth.tick, observed.tick):
            return None
        true = true_state(observed)
        if self._seen == 1:
            self._moved_m[:2] = unrounded((found.base_position - true.base_position)[:2])
        true = true._replace(base_position=true.base_position + self._moved_m)
        self._judged += 1
        self._last = found, true
        if observed.truth.tick == observed.tick:
            self._squares += (found.base_linear_velocity - true.base_linear_velocity) ** 2
            self._compared += 1
        return true

    def errors(self) -> dict[str, object]:
        """Return the errors that `EstimatedMotion.summary` describes; unknown ones are None."""
        velocity = np.sqrt(self._squares / self._compared).tolist() if self._compared else None
        place_m, heading_rad = (None, None) if self._last is None else apart(*self._last)
        return {
            "velocity_error_m_s": velocity,
            "place_error_m": place_m,
            "heading_error_rad": heading_rad,
        }

    @property
    def recorded(self) -> str:
        """The motion that a run has recorded: `TRUTH`, `ESTIMATE`, or `BOTH`."""
        if not self._judged:
            return ESTIMATE
        return TRUTH if self._judged == self._seen else BOTH


def _is_current(truth_tick: int, tick: int) -> bool:
    """Return whether a truth belongs to the time of a state.

    In real time, the truth of the next state may be there already. Any other truth is stale, or
    not from a simulation: a real robot's sport mode publishes on the same topic.
    """
    # A message without a stamp has no time.
    return truth_tick > 0 and TICK_S * abs(truth_tick - tick) <= LATEST_S


def unrounded(values: np.ndarray) -> np.ndarray:
    """Return values in m or rad, with 0 in place of those that only rounding makes differ from it.

    A robot that was made for a run is at the origin, to the last bit as without messages.
    """
    return np.where(np.abs(values) < ROUNDING, 0.0, values)


def apart(found: RobotState, true: RobotState) -> tuple[float, float]:
    """Return the distance of two places in the plane, in m, and of headings, in rad."""
    turn_rad = in_plane(found)[0] - in_plane(true)[0]
    return (
        float(np.linalg.norm((found.base_position - true.base_position)[:2])),
        float(abs(wrap(turn_rad))),
    )


def needed(name: str) -> Topic | None:
    """Return the topic that an estimator needs beside the states; None for none."""
    if name == TRUTH:
        return TRUTHS
    return ODOMETRY if name in BY_ODOMETRY else None
