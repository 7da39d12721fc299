"""The H1 in closed loop with a controller that walks, or moves its arm, as a schedule wants.

The schedule gives utilities and goals, no more: what drives the robot is decided by the gates that
the controller shows. While the arm's is open its torques drive the right arm; all other joints
follow the policy's targets, which are the default pose while the policy is silent.

What the arm is told of places is seen from the torso, as if that were upright at 1.06 m.
"""

from collections.abc import Sequence

import nengo
import numpy as np

from spikeport.experiments.arm.loop import Recording as ArmRecording
from spikeport.experiments.arm.loop import Sample as ArmSample
from spikeport.experiments.arm.task import Task
from spikeport.experiments.switch.anchor import Anchor
from spikeport.experiments.switch.goals import Goal
from spikeport.experiments.walk.loop import OUTPUTS as WALK_OUTPUTS
from spikeport.experiments.walk.loop import WalkLoop
from spikeport.experiments.walk.paths import Path
from spikeport.networks.arm import STATE_SIZE as ARM_STATE_SIZE
from spikeport.networks.humanoid import ACTIONS, HumanoidNetwork
from spikeport.networks.path_following import COMMAND_SIZE
from spikeport.networks.region import Box
from spikeport.robot.description import ARM_JOINTS, JOINTS
from spikeport.robot.walk_interface import ACTION_SIZE, targets_rad

OPEN = 0.5
"""Above it a gate is open."""
ANCHORED_PELVIS_M = np.array([0.0, 0.0, 1.06])
DRAW = ACTIONS.index("draw")
BODY_JOINTS = tuple(joint for joint in JOINTS if joint not in ARM_JOINTS)
_BODY = [JOINTS.index(joint) for joint in BODY_JOINTS]
_NOWHERE = Path(np.array([0.0, 1.0]), np.zeros((2, 2)))

INPUTS = np.cumsum([ACTION_SIZE, COMMAND_SIZE, len(ARM_JOINTS), len(ACTIONS)]).tolist()
"""Where action, command, torque and gates end in what the controller gives."""
OUTPUTS = [*WALK_OUTPUTS, *(WALK_OUTPUTS[-1] + np.cumsum([ARM_STATE_SIZE, 3, len(ACTIONS)]))]
"""Where observation, reference, state, arm state, target and utilities end in what it is shown."""


class SwitchLoop(WalkLoop):
    """Plant and goals, stepped by what a controller gives; arguments are those of `WalkLoop`.

    Parameters
    ----------
    anchors : bool
        Whether the pelvis is welded to the world while the arm's gate is open.

    Attributes
    ----------
    paths : list of Path or None
        The path of every phase so far, where it was laid down; None where the arm worked.
    hands_m : list of array
        Where the hand was in the world at every physics step.
    """

    def __init__(
        self,
        anchors: bool,
        encoding: Box | None,
        observe_every_s: float,
        dt_s: float,
        appearance: str = "primitive",
    ) -> None:
        super().__init__(encoding, observe_every_s, dt_s, appearance)
        self._anchor = Anchor(self.plant) if anchors else None
        self._torso = self.plant.model.body("torso_link").id

    def start(self, seed: int, goals: Sequence[Goal]) -> None:
        """Put the robot where the first phase begins, standing as a seed varies it."""
        self._goals, self.paths = goals, list[Path | None]()
        self._arm_samples = list[ArmSample]()
        self.hands_m = list[np.ndarray]()
        self._torque, self._gates = np.zeros(len(ARM_JOINTS)), np.zeros(len(ACTIONS))
        self.begin(seed, _NOWHERE)
        if self._anchor is not None:
            self._anchor.reset()

    def arm_recording(self) -> ArmRecording:
        """What the arm's controller saw and did, at all times; places as seen from the torso."""
        return ArmRecording(*(np.array(column) for column in zip(*self._arm_samples, strict=True)))

    def step(self, output: np.ndarray) -> np.ndarray:
        """[action, command, torque, gates] in, what `OUTPUTS` names out."""
        _, commanded, moved, gated = INPUTS
        self._torque, self._gates = output[commanded:moved].copy(), output[moved:gated].copy()
        return super().step(output[:commanded])

    def _drive(self, action: np.ndarray) -> None:
        plant, draws = self.plant, bool(self._gates[DRAW] > OPEN)
        if self._anchor is not None:
            self._anchor.update(draws)
        targets = targets_rad(action)
        if draws:
            plant.hold(BODY_JOINTS, targets[_BODY])
            plant.torque(ARM_JOINTS, self._torque)
        else:
            plant.hold(JOINTS, targets)

    def _record(self, action: np.ndarray, command: np.ndarray) -> None:
        super()._record(action, command)
        self._arm_samples.append(ArmSample(self.plant.time_s, *self._arm_seen, self._torque))
        self.hands_m.append(self.plant.hand_position())

    def _locate(self) -> None:
        """Look at the whole of the robot, and at what it is to do."""
        hand = self._hand_from_torso()
        self._move_on(hand)
        super()._locate()
        target = hand if self._task is None else self._task.target
        self._arm_seen = *self.plant.motion(ARM_JOINTS), hand, target
        self._shown = np.concatenate((self._shown, *self._arm_seen, self._utilities))

    def _hand_from_torso(self) -> np.ndarray:
        data = self.plant.data
        apart = self.plant.hand_position() - data.xpos[self._torso]
        return np.asarray(ANCHORED_PELVIS_M + apart @ data.xmat[self._torso].reshape(3, 3))

    def _move_on(self, hand: np.ndarray) -> None:
        """Begin the next phase if it is time to, and move the arm's target on."""
        time_s, number = self.plant.time_s, len(self.paths)
        if number < len(self._goals) and time_s > self._goals[number].phase.begin_s - 1e-9:
            self._begin_phase(self._goals[number], hand)
        elif self._task is not None:
            self._task.update(time_s - self._goals[number - 1].phase.begin_s, hand)

    def _begin_phase(self, goal: Goal, hand: np.ndarray) -> None:
        self._utilities = goal.phase.values
        self._task: Task | None = goal.task(hand)
        if goal.path is not None:
            self._follow(goal.path.laid(self.plant.data.qpos[:2], self._heading_rad()))
        self.paths.append(None if goal.path is None else self.path)


def close_loop(net: HumanoidNetwork, loop: SwitchLoop) -> None:
    """Connect a controller of the current network with the plant, through connections only."""
    plant = nengo.Node(
        lambda _t, output: loop.step(output),
        size_in=INPUTS[-1],
        size_out=OUTPUTS[-1],
        label="plant",
    )
    told = (
        net.observation,
        net.follower.reference,
        net.follower.state,
        net.arm.state,
        net.arm.target,
        net.utilities,
    )
    for node, begin, end in zip(told, [0, *OUTPUTS], OUTPUTS, strict=False):
        nengo.Connection(plant[begin:end], node, synapse=None)
    given = net.action, net.command, net.torque, net.gates
    for node, begin, end in zip(given, [0, *INPUTS], INPUTS, strict=False):
        nengo.Connection(node, plant[begin:end], synapse=None)
