"""A schedule at work: utilities and goals of its phases, and the gates of legs and arm.

The schedule only sets utilities and goals; the gates that the controller returns decide what drives
the robot. While the arm's gate is open, torques drive the right arm. The other joints follow the
policy's targets, which are the default pose while the policy is silent.

The arm's controller observes places in the torso's frame (`spikeport.experiments.switch.frames`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spikeport.experiments.arm.draw_task import DrawTask
from spikeport.experiments.arm.port import ArmPort
from spikeport.experiments.arm.recording import ArmTask
from spikeport.experiments.loop import Port
from spikeport.experiments.recording import Recording
from spikeport.experiments.switch.anchor import Anchor
from spikeport.experiments.switch.frames import Frame
from spikeport.experiments.switch.goals import Goal
from spikeport.experiments.trial import Rig
from spikeport.experiments.walk.approach import TurnFirst
from spikeport.experiments.walk.path_file import path_files
from spikeport.experiments.walk.paths import WalkPath
from spikeport.experiments.walk.port import NOWHERE, WalkPort
from spikeport.networks.humanoid import ACTIONS
from spikeport.networks.region import Box
from spikeport.robot.plant import Plant
from spikeport.robot.times import ROUNDING_S

OPEN = 0.5
"""A gate above this value is open."""
DRAW = ACTIONS.index("draw")


class Workplace:
    """The place where the arm works in a phase: on a sheet, in front of the torso, or nowhere.

    Parameters
    ----------
    plant : Plant
        The robot.

    Attributes
    ----------
    task : ArmTask or None
        The task of the arm; None while the robot walks.
    sheet : Frame
        The frame of the sheet to draw on.
    local_hand : (3,) array
        The hand in the frame of its task, the sheet's or the torso's, in m.
    hand : (3,) array
        The hand's place in the world, in m.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._torso = plant.model.body("torso_link").id
        self._draws, self._begin_s = False, 0.0
        self.task: ArmTask | None = None
        self.sheet = self._torso_frame()
        self.hand = self.local_hand = plant.hand_position()

    def begin(self, goal: Goal) -> None:
        """Begin a phase now."""
        self._draws, self._begin_s = goal.phase.arm == "digit", goal.phase.begin_s
        torso = self._torso_frame()
        self._move_sheet(torso)
        frame = self._frame(torso)
        self.task = goal.task(frame.local(self._plant.hand_position()))

    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Return hand and target (3,) in the torso's frame; both are the hand in walking phases."""
        torso = self._torso_frame()
        self._move_sheet(torso)
        frame = self._frame(torso)
        self.hand = self._plant.hand_position()
        self.local_hand = frame.local(self.hand)
        if self.task is None:
            return torso.local(self.hand), torso.local(self.hand)
        self.task.update(self._since_s, self.local_hand)
        return torso.local(self.hand), torso.local(frame.world(self.task.target))

    @property
    def _since_s(self) -> float:
        return self._plant.time_s - self._begin_s

    def _torso_frame(self) -> Frame:
        return Frame.of_torso(self._plant.data, self._torso)

    def _move_sheet(self, torso: Frame) -> None:
        """Move the sheet with the torso until the pen sets down, and slowly behind it from then on.

        So strides do not shake the drawing.
        """
        if self._draws:
            now, draws = torso.upright(), self._since_s > DrawTask.begin_s + ROUNDING_S
            self.sheet = self.sheet.following(now, self._plant.dt_s) if draws else now

    def _frame(self, torso: Frame) -> Frame:
        """Return the frame of the task: the sheet while drawing, else the torso."""
        return self.sheet if self._draws else torso


@dataclass(frozen=True)
class WorkRecording(Recording):
    """The hand at every physics step, whatever the arm does.

    Attributes
    ----------
    local_m : (n, 3) array
        The hand in the frame of its task, the sheet's or the torso's, in m.
    hands_m : (n, 3) array
        The hand's place in the world, in m.
    """

    local_m: np.ndarray
    hands_m: np.ndarray


class ScheduleGate(Port):
    """The gate of legs and arm: gates (2,) of `ACTIONS` in, their utilities (2,) out.

    Parameters
    ----------
    plant : Plant
        The robot.
    walk : WalkPort
        The port of its legs, which follow the path of each walking phase.
    arm : ArmPort
        The port of its arm.
    place : Workplace
        The workplace of the arm.
    anchors : bool
        True if the pelvis is welded to the world while the arm's gate is open.

    Attributes
    ----------
    goals : sequence of Goal
        The goals of the schedule.
    utilities : (2,) array
        The utilities of the present phase.
    paths : list of WalkPath or None
        The path of every phase so far, at its place in the world; None where the arm worked.
    """

    size_in = size_out = len(ACTIONS)

    def __init__(
        self, plant: Plant, walk: WalkPort, arm: ArmPort, place: Workplace, anchors: bool
    ) -> None:
        self._plant, self._walk, self._arm, self._place = plant, walk, arm, place
        self._anchor = Anchor(plant) if anchors else None
        self.utilities = np.zeros(len(ACTIONS))
        self._rows: list[tuple[object, ...]] = []
        self.goals: Sequence[Goal] = ()
        self.paths: list[WalkPath | None] = []

    def begin(self) -> None:
        """Begin the schedule, with the robot standing."""
        self.paths, self._rows = [], []
        self._walk.follow(NOWHERE)
        self._walk.approach = None
        if self._anchor is not None:
            self._anchor.reset()

    def observe(self) -> np.ndarray:
        """Begin the next phase if it is time to, and return the utilities of the present one."""
        number = len(self.paths)
        if number < len(self.goals):
            goal = self.goals[number]
            # Times are sums of steps: a phase may begin a rounding error early.
            if self._plant.time_s - goal.phase.begin_s > -ROUNDING_S:
                self._begin_phase(goal)
        return self.utilities

    def _begin_phase(self, goal: Goal) -> None:
        self.utilities = np.array(goal.phase.values)
        self._place.begin(goal)
        path = goal.path
        if path is not None:
            # A path begins at the robot's present place, wherever earlier phases have left it, as
            # the follower observes it.
            now = self._plant.in_plane
            path = path.laid(now[1:3], now[0])
            self._walk.follow(path)
            # The reference on a user's path may stand or turn back; on the others it never does.
            of_user = path_files(str(goal.phase.path))
            self._walk.approach = TurnFirst() if of_user else None
        self.paths.append(path)

    def drive(self, gates: np.ndarray) -> None:
        """Let torques drive the arm while its gate is open, and weld the pelvis if asked to."""
        draws = gates.item(DRAW) > OPEN
        self._rows.append((self._plant.time_s, self._place.local_hand, self._place.hand))
        if self._anchor is not None:
            self._anchor.update(draws)
        self._walk.lends_arm = self._arm.drives = draws

    def recording(self) -> WorkRecording:
        """Return the recording of the hand so far."""
        return WorkRecording.of(self._rows)


class HumanoidRig(Rig):
    """The robot in closed loop by its legs and its right arm, in the phases of a schedule.

    Parameters
    ----------
    plant : Plant
        The robot.
    anchors : bool
        True if the pelvis is welded to the world while the arm's gate is open.
    encoding : Box or None
        Range of the observations that the policy represents.
    observe_every_s, dt_s : float
        Time from one observation of the policy to the next, and the controller's time step.
    """

    def __init__(
        self, plant: Plant, anchors: bool, encoding: Box | None, observe_every_s: float, dt_s: float
    ) -> None:
        self.place = Workplace(plant)
        self.walk = WalkPort(plant, encoding, observe_every_s)
        self.arm = ArmPort(plant, self.place)
        self.gate = ScheduleGate(plant, self.walk, self.arm, self.place, anchors)
        super().__init__(plant, [self.walk, self.arm], dt_s, self.gate)

    def begin(self, seed: int, goals: Sequence[Goal]) -> None:
        """Put the robot where the first phase begins, in a standing pose that the seed varies."""
        self.plant.reset(seed)
        self.gate.goals = goals
        self.loop.begin()
