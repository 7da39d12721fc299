"""The H1 in closed loop with a controller that walks, or moves its arm, as a schedule wants.

The schedule gives utilities and goals, no more: what drives the robot is decided by the gates that
the controller shows. While the arm's is open its torques drive the right arm; all other joints
follow the policy's targets, which are the default pose while the policy is silent.

What the arm is told of places is seen from the torso (`experiments.switch.frames`).
"""

from collections.abc import Sequence

import nengo
import numpy as np

from spikeport.experiments.arm.draw_task import DrawTask
from spikeport.experiments.arm.loop import Recording as ArmRecording
from spikeport.experiments.arm.loop import Sample as ArmSample
from spikeport.experiments.arm.task import Task
from spikeport.experiments.switch.anchor import Anchor
from spikeport.experiments.switch.frames import Frame
from spikeport.experiments.switch.goals import Goal
from spikeport.experiments.switch.schedule import ROUNDING_S
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
    seen_m : list of array
        The hand as the arm's task sees it, at every physics step: on its sheet, or from the torso.
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
        self.seen_m, self.hands_m = list[np.ndarray](), list[np.ndarray]()
        self._torque, self._gates = np.zeros(len(ARM_JOINTS)), np.zeros(len(ACTIONS))
        self.begin(seed, _NOWHERE)
        if self._anchor is not None:
            self._anchor.reset()

    def arm_recording(self) -> ArmRecording:
        """What the arm's controller saw and did, at all times; places as seen from the torso."""
        return ArmRecording(*(np.array(column) for column in zip(*self._arm_samples, strict=True)))

    def _physics(self, given: np.ndarray) -> None:
        """One step, given [action, command, torque, gates]."""
        _, commanded, moved, gated = INPUTS
        self._torque, self._gates = given[commanded:moved], given[moved:gated]
        super()._physics(given[:commanded])

    def _drive(self, action: np.ndarray) -> None:
        plant, draws = self.plant, self._gates.item(DRAW) > OPEN
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
        self.seen_m.append(self._seen)
        self.hands_m.append(self._hand)

    def _locate(self) -> None:
        """Look at the whole of the robot, and at what it is to do."""
        torso = Frame.of_torso(self.plant.data, self._torso)
        self._hand = hand = self.plant.hand_position()
        number = len(self.paths)
        if number < len(self._goals) and self._since_s(self._goals[number]) > -ROUNDING_S:
            self._begin_phase(self._goals[number], torso, hand)
        super()._locate()
        seen = torso.seen(hand), torso.seen(self._wanted(torso, hand))
        self._arm_seen = *self.plant.motion(ARM_JOINTS), *seen
        self._shown = np.concatenate((self._shown, *self._arm_seen, self._utilities))

    def _since_s(self, goal: Goal) -> float:
        """Time since a phase began, negative before."""
        return self.plant.time_s - goal.phase.begin_s

    def _begin_phase(self, goal: Goal, torso: Frame, hand: np.ndarray) -> None:
        self._goal, self._utilities = goal, goal.phase.values
        self._task: Task | None = goal.task(self._frame(torso).seen(hand))
        if goal.path is not None:
            self._follow(goal.path.laid(self.plant.data.qpos[:2], self._heading_rad()))
        self.paths.append(None if goal.path is None else self.path)

    def _wanted(self, torso: Frame, hand: np.ndarray) -> np.ndarray:
        """Where the hand is to be in the world: where it is, while the robot walks."""
        frame = self._frame(torso)
        self._seen = frame.seen(hand)
        if self._task is None:
            return hand
        self._task.update(self._since_s(self._goal), self._seen)
        return frame.world(self._task.target)

    def _frame(self, torso: Frame) -> Frame:
        """In which the arm's task is given: that of the sheet, or of the torso."""
        if self._goal.phase.arm != "digit":
            return torso
        now, pen_down = torso.upright(), self._since_s(self._goal) > DrawTask.begin_s
        self._sheet: Frame = self._sheet.following(now, self.plant.dt_s) if pen_down else now
        return self._sheet


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
