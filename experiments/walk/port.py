"""The legs of the H1, driven by a walking policy and a path follower."""

import numpy as np

from spikeport.experiments.trial import Rig
from spikeport.experiments.walk.approach import TurnFirst
from spikeport.experiments.walk.legs import LegsPort
from spikeport.experiments.walk.paths import WalkPath
from spikeport.experiments.walk.recording import WalkRecording
from spikeport.networks.path_following import REFERENCE_SIZE, STATE_SIZE
from spikeport.networks.region import Box
from spikeport.robot.description import ARM_JOINTS, JOINTS
from spikeport.robot.feet import Feet
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import OBSERVATION_SIZE

LEAD_S = 0.8
"""The lead of the reference at the start. If it began at the robot, the direction to
it would only be that of the gait's sway."""

NOWHERE = WalkPath(np.array([0.0, 1.0]), np.zeros((2, 2)))
"""The path of a robot that is not to walk."""

BODY_JOINTS = tuple(joint for joint in JOINTS if joint not in ARM_JOINTS)
_BODY = [JOINTS.index(joint) for joint in BODY_JOINTS]


class WalkPort(LegsPort):
    """The legs with a path: [action, command] (21,) in; [observation, reference, state] (78,) out.

    Parameters
    ----------
    plant, encoding, observe_every_s
        As `LegsPort`.
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
    inputs : tuple of array
        The last observation (69,), before it is clipped, with reference (4,) and state (5,), as
        controllers observe it; the recording has the true state.
    """

    size_out = OBSERVATION_SIZE + REFERENCE_SIZE + STATE_SIZE

    def __init__(
        self,
        plant: Plant,
        encoding: Box | None,
        observe_every_s: float,
        approach: TurnFirst | None = None,
    ) -> None:
        super().__init__(plant, encoding, observe_every_s)
        self.approach = approach
        self._feet = Feet(plant.model)
        self.path, self._path_begun_s = NOWHERE, 0.0
        self.lends_arm = False
        self.inputs: tuple[np.ndarray, ...] = ()
        self._rows: list[tuple[object, ...]] = []
        self._true_turn: tuple[np.ndarray, ...] = ()

    def follow(self, path: WalkPath) -> None:
        """Begin a path now."""
        self.path, self._path_begun_s = path, self._plant.time_s

    def begin(self) -> None:
        """Forget the recording; the path stays."""
        super().begin()
        if self.approach is not None:
            self.approach.begin()
        self._rows = []

    def observe(self) -> np.ndarray:
        """Return the policy's observation, clipped, and the follower's reference and state."""
        clipped, plant = super().observe(), self._plant
        state = plant.in_plane
        reference = self.path.at(plant.time_s - self._path_begun_s + LEAD_S)
        self.inputs = self.observed, reference, state
        return np.concatenate((clipped, reference, state))

    def _look(self) -> None:
        super()._look()
        data = self._plant.true_data
        self._true_turn = data.qpos[3:7].copy(), data.qvel[3:6].copy()

    def _obey(self, action: np.ndarray, command: np.ndarray) -> None:
        if self.approach is not None:
            command = self.approach.limited(command, *self.inputs[1:])
        super()._obey(action, command)
        plant, (observed, reference, _) = self._plant, self.inputs
        on_floor = self._feet.on_floor(plant.true_data)
        moved = reference, plant.true_in_plane, action, command
        self._rows.append(
            (plant.time_s, observed, *moved, self._height_m, on_floor, *self._true_turn)
        )

    def _hold(self, targets: np.ndarray) -> None:
        if self.lends_arm:
            self._plant.hold(BODY_JOINTS, targets[_BODY])
        else:
            super()._hold(targets)

    def recording(self) -> WalkRecording:
        """Return the observations and actions so far."""
        return WalkRecording.of(self._rows)


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
