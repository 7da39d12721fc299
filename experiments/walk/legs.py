"""The legs of the H1, driven by a walking policy."""

import numpy as np

from spikeport.compiled import compiled, make_ready
from spikeport.experiments.loop import Port
from spikeport.experiments.port_values import check_finite
from spikeport.experiments.walk.recording import fallen
from spikeport.networks.path_following import COMMAND_SIZE
from spikeport.networks.region import Box
from spikeport.robot.description import JOINTS
from spikeport.robot.plant import Plant
from spikeport.robot.state import PELVIS, RobotState
from spikeport.robot.walk_interface import (
    ACTION_SIZE,
    COMMAND_CHANGE_PER_S,
    CONTROL_DT_S,
    OBSERVATION_SIZE,
    observation,
    targets_rad,
)

OBSERVATION_DT_S = 0.005
"""Time from one observation of a spiking policy to the next."""


class LegsPort(Port):
    """Legs and body: [action, command] (21,) in; observation (69,) out.

    The action moves the joints. The policy observes the command, forward speed in m/s and yaw rate
    in rad/s, together with the robot's motion.

    Parameters
    ----------
    plant : Plant
        The robot.
    encoding : Box or None
        Range of the observations that the policy represents; values beyond it are clipped.
    observe_every_s : float
        Time from one observation to the next, a multiple of the physics step.

    Attributes
    ----------
    fallen_at_s : float or None
        The time at which the robot fell, which ends the run.
    observed : (69,) array
        The last observation, before it is clipped.
    """

    size_in = ACTION_SIZE + COMMAND_SIZE
    size_out = OBSERVATION_SIZE

    def __init__(self, plant: Plant, encoding: Box | None, observe_every_s: float) -> None:
        self._plant = plant
        self.encoding = encoding
        self._observe_every_s = observe_every_s
        self._observe_steps = round(observe_every_s / plant.dt_s)
        self.observed, self._clipped = np.zeros(OBSERVATION_SIZE), np.zeros(OBSERVATION_SIZE)
        self._start()

    def _start(self) -> None:
        self.fallen_at_s: float | None = None
        self._policy_view = PolicyView(self._observe_every_s)
        self._answer, self._command = np.zeros(ACTION_SIZE), np.zeros(COMMAND_SIZE)
        self._n_driven = 0

    def begin(self) -> None:
        """Forget an earlier run."""
        self._start()

    @property
    def over(self) -> bool:
        """True once the robot fell."""
        return self.fallen_at_s is not None

    def observe(self) -> np.ndarray:
        """Return the policy's last observation, clipped."""
        self._height_m = self._plant.height_m
        if fallen(self._height_m, self._plant.true_data.xmat[PELVIS][8]):
            self.fallen_at_s = self._plant.time_s
        if self._n_driven % self._observe_steps == 0:
            self._look()
        return self._clipped

    def _look(self) -> None:
        """Take a new observation."""
        self.observed = self._policy_view.look(self._plant.state, self._command, self._answer)
        known = self.encoding
        self._clipped = self.observed if known is None else known.clip(self.observed)

    def drive(self, values: np.ndarray) -> None:
        """Hold the joints at the action's targets; DivergedError if a value is not finite."""
        action = values[:ACTION_SIZE]
        # Obeyed before the check, so that a recording shows values that are not finite.
        self._obey(action, values[ACTION_SIZE:])
        check_finite("action or command", values, self._plant.time_s)
        self._hold(targets_rad(action))

    def _obey(self, action: np.ndarray, command: np.ndarray) -> None:
        """Keep action and command for the next observation."""
        if self._n_driven % self._observe_steps == 0:
            self._answer = action
        self._command = command
        self._n_driven += 1

    def _hold(self, targets: np.ndarray) -> None:
        self._plant.hold(JOINTS, targets)


class PolicyView:
    """The robot's motion as a walking policy observes it; no sideways speed is commanded.

    Commands change no faster than in training, as from a walk to a stand.

    The last action in the observation is that of 20 ms ago, as in training. A policy that observes
    every 5 ms gets the mean of the 7 actions around that time. With a single action, it would
    behave like four policies in turn, each seeing only its own actions, and they might lift
    different feet: with noise of 0.015 rad on its actions, 10 of 24 robots fell as they set off.
    With the mean, none fell.

    Parameters
    ----------
    every_s : float
        Time from one observation to the next.
    """

    def __init__(self, every_s: float) -> None:
        # As many as lie within one control period to either side of the action of one period ago.
        n_last = 2 * round(CONTROL_DT_S / every_s) - 1
        self._last = np.zeros((n_last, ACTION_SIZE))
        self._change = COMMAND_CHANGE_PER_S * every_s
        self._command = np.zeros(len(COMMAND_CHANGE_PER_S))
        self._action = np.zeros(ACTION_SIZE)
        held = self._last, self._action, self._command
        self._go_on = make_ready(_go_on, *held, self._action, (0.0, 0.0, 0.0), self._change)

    def look(self, state: RobotState, command: np.ndarray, action: np.ndarray) -> np.ndarray:
        """Return the observation (69,).

        Parameters
        ----------
        state : RobotState
            The motion of the robot.
        command : (2,) array
            The wanted forward speed in m/s and yaw rate in rad/s.
        action : (19,) array
            The policy's answer to the last observation; zeros at the start.
        """
        wanted = command.item(0), 0.0, command.item(1)
        self._go_on(self._last, self._action, self._command, action, wanted, self._change)
        return observation(state, self._command, self._action)


@compiled
def _go_on(
    last: np.ndarray,
    mean: np.ndarray,
    command: np.ndarray,
    action: np.ndarray,
    wanted: tuple[float, float, float],
    change: np.ndarray,
) -> None:
    """Put an action behind the last ones, and change the command towards the wanted one.

    ``last`` (n, 19) are actions, the oldest first, and ``mean`` (19,) is their mean, summed in this
    order; ``command`` (3,) changes by ``change`` at most.
    """
    n = len(last)
    for j in range(len(mean)):
        for i in range(n - 1):
            last[i, j] = last[i + 1, j]
        last[n - 1, j] = action[j]
        total = last[0, j]
        for i in range(1, n):
            total += last[i, j]
        mean[j] = total / n
    for k in range(len(command)):
        command[k] += min(max(wanted[k] - command[k], -change[k]), change[k])
