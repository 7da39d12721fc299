"""The legs of the H1, driven by a walking policy and a path follower."""

import numpy as np

from spikeport.compiled import compiled, make_ready
from spikeport.errors import DivergedError
from spikeport.experiments.loop import Port
from spikeport.experiments.trial import Rig
from spikeport.experiments.walk.approach import TurnFirst
from spikeport.experiments.walk.paths import WalkPath
from spikeport.experiments.walk.recording import WalkRecording, fallen
from spikeport.networks.path_following import COMMAND_SIZE, REFERENCE_SIZE, STATE_SIZE
from spikeport.networks.region import Box
from spikeport.robot.description import ARM_JOINTS, JOINTS
from spikeport.robot.feet import Feet
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

LEAD_S = 0.8
"""The lead of the reference at the start. If it began at the robot, the direction to
it would only be that of the gait's sway."""

OBSERVATION_DT_S = 0.005
"""Time from one observation of a spiking policy to the next."""

NOWHERE = WalkPath(np.array([0.0, 1.0]), np.zeros((2, 2)))
"""The path of a robot that is not to walk."""

BODY_JOINTS = tuple(joint for joint in JOINTS if joint not in ARM_JOINTS)
_BODY = [JOINTS.index(joint) for joint in BODY_JOINTS]


class WalkPort(Port):
    """Legs and body: [action, command] (21,) in; [observation, reference, state] (78,) out.

    Parameters
    ----------
    plant : Plant
        The robot.
    encoding : Box or None
        Range of the observations that the policy represents; values beyond it are clipped.
    observe_every_s : float
        Time from one observation to the next, a multiple of the physics step.
    approach : TurnFirst or None
        Limits the commands of the follower; None leaves them as they are.

    Attributes
    ----------
    path : WalkPath
        The path that the robot follows.
    approach : TurnFirst or None
        The present limits of the follower's commands.
    lends_arm : bool
        True if another port drives the right arm; the action then drives all other joints.
    fallen_at_s : float or None
        The time at which the robot fell, which ends the run.
    inputs : tuple of array
        The last observation (69,), before it is clipped, with reference (4,) and state (5,), as
        controllers observe it; the recording has the true state.
    """

    size_in = ACTION_SIZE + COMMAND_SIZE
    size_out = OBSERVATION_SIZE + REFERENCE_SIZE + STATE_SIZE

    def __init__(
        self,
        plant: Plant,
        encoding: Box | None,
        observe_every_s: float,
        approach: TurnFirst | None = None,
    ) -> None:
        self._plant = plant
        self.approach = approach
        self._feet = Feet(plant.model)
        self._observe_steps = round(observe_every_s / plant.dt_s)
        self._observe_every_s = observe_every_s
        self.encoding = encoding
        self.path, self._path_begun_s = NOWHERE, 0.0
        self.lends_arm = False
        self.fallen_at_s: float | None = None
        self.inputs: tuple[np.ndarray, ...] = ()
        self._rows: list[tuple[object, ...]] = []
        self._policy_view = PolicyView(observe_every_s)
        self._observed, self._clipped = np.zeros(OBSERVATION_SIZE), np.zeros(OBSERVATION_SIZE)
        self._true_turn: tuple[np.ndarray, ...] = ()
        self._answer, self._command = np.zeros(ACTION_SIZE), np.zeros(COMMAND_SIZE)

    def follow(self, path: WalkPath) -> None:
        """Begin a path now."""
        self.path, self._path_begun_s = path, self._plant.time_s

    def begin(self) -> None:
        """Forget the recording; the path stays."""
        self.fallen_at_s = None
        if self.approach is not None:
            self.approach.begin()
        self._rows = []
        self._policy_view = PolicyView(self._observe_every_s)
        self._answer, self._command = np.zeros(ACTION_SIZE), np.zeros(COMMAND_SIZE)

    @property
    def over(self) -> bool:
        """True once the robot fell."""
        return self.fallen_at_s is not None

    def observe(self) -> np.ndarray:
        """Return the policy's observation, clipped, and the follower's reference and state."""
        plant, data = self._plant, self._plant.data
        if fallen(plant.height_m, data.xmat[PELVIS][8]):
            self.fallen_at_s = plant.time_s
        if len(self._rows) % self._observe_steps == 0:
            self._observed = self._policy_view.look(plant.state, self._command, self._answer)
            known = self.encoding
            self._clipped = self._observed if known is None else known.clip(self._observed)
            self._true_turn = data.qpos[3:7].copy(), data.qvel[3:6].copy()
        state = plant.in_plane
        reference = self.path.at(plant.time_s - self._path_begun_s + LEAD_S)
        self.inputs = self._observed, reference, state
        return np.concatenate((self._clipped, reference, state))

    def drive(self, values: np.ndarray) -> None:
        """Hold the joints at the action's targets; DivergedError if a value is not finite."""
        action, command = values[:ACTION_SIZE], values[ACTION_SIZE:]
        if self.approach is not None:
            command = self.approach.limited(command, *self.inputs[1:])
        # Recorded before the check, so that the last states show values that are not finite.
        self._record(action, command)
        if np.count_nonzero(np.isfinite(values)) < len(values):
            raise DivergedError(
                f"the controller's action or command is not finite at {self._plant.time_s:.3f} s, "
                "limit finite numbers; cure: look at its inputs in the last states"
            )
        targets = targets_rad(action)
        if self.lends_arm:
            self._plant.hold(BODY_JOINTS, targets[_BODY])
        else:
            self._plant.hold(JOINTS, targets)

    def _record(self, action: np.ndarray, command: np.ndarray) -> None:
        if len(self._rows) % self._observe_steps == 0:
            self._answer = action
        self._command = command
        plant, (observed, reference, _) = self._plant, self.inputs
        on_floor = self._feet.on_floor(plant.data)
        moved = reference, plant.true_in_plane, action, command
        self._rows.append(
            (plant.time_s, observed, *moved, plant.height_m, on_floor, *self._true_turn)
        )

    def recording(self) -> WalkRecording:
        """Return the observations and actions so far."""
        return WalkRecording.of(self._rows)


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


class WalkRig(Rig):
    """The free robot in closed loop by its legs.

    Parameters
    ----------
    plant : Plant
        The robot.
    encoding : Box or None
        Range of the observations that the policy represents.
    observe_every_s, dt_s : float
        Time from one observation of the policy to the next, and the controller's time step.
    approach : TurnFirst or None
        Limits the commands of the follower.
    """

    def __init__(
        self,
        plant: Plant,
        encoding: Box | None,
        observe_every_s: float,
        dt_s: float,
        approach: TurnFirst | None = None,
    ) -> None:
        self.walk = WalkPort(plant, encoding, observe_every_s, approach)
        super().__init__(plant, [self.walk], dt_s)

    def begin(self, seed: int, path: WalkPath) -> None:
        """Put the robot at the start of a path, in a standing pose that the seed varies.

        The path of a robot that is there already, such as a real one, begins where it stands.
        """
        self.plant.reset(seed)
        heading_rad, *place = self.plant.start.tolist()
        self.walk.follow(path.laid(np.array(place), heading_rad))
        self.loop.begin()
