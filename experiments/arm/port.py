"""The right arm of the H1, driven by torques."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from spikeport.experiments.arm.recording import ArmRecording, ArmTask
from spikeport.experiments.loop import Port
from spikeport.experiments.port_values import check_finite
from spikeport.experiments.trial import Rig
from spikeport.networks.arm import STATE_SIZE
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.robot.description import ARM_JOINTS
from spikeport.robot.plant import Plant


class Aim(Protocol):
    """The source of the places that an arm's controller observes."""

    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the places of the hand and of its target, (3,) each, in m."""


class TaskAim:
    """A task in world coordinates, for an arm whose torso is held upright.

    Parameters
    ----------
    plant : Plant
        The robot.

    Attributes
    ----------
    task : ArmTask or None
        The task of its arm; None for a hand that is to stay where it is.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self.task: ArmTask | None = None

    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Return hand and target (3,) in the world, in m."""
        hand = self._plant.hand_position()
        if self.task is None:
            return hand, hand
        self.task.update(self._plant.time_s, hand)
        return hand, self.task.target


class ArmPort(Port):
    """The right arm: torques (4,) in N m in; angles, velocities, hand and target out.

    Parameters
    ----------
    plant : Plant
        The robot.
    aim : Aim
        The source of the hand's place and target.

    Attributes
    ----------
    drives : bool
        True if its torques drive the arm; they are recorded in any case.
    inputs : tuple of array
        The last observation: angles (4,), velocities (4,), hand (3,) and target (3,).
    """

    size_in = len(ARM_JOINTS)
    size_out = STATE_SIZE + 3

    def __init__(self, plant: Plant, aim: Aim) -> None:
        self._plant = plant
        self._aim = aim
        self._rows: list[tuple[object, ...]] = []
        self.drives = True
        self.inputs: tuple[np.ndarray, ...] = ()

    def begin(self) -> None:
        """Forget the recording."""
        self._rows = []

    def observe(self) -> np.ndarray:
        """Return [q, dq, hand, target], (14,)."""
        self.inputs = (*self._plant.motion(ARM_JOINTS), *self._aim.places())
        return np.concatenate(self.inputs)

    def drive(self, torque: np.ndarray) -> None:
        """Apply torques; raises DivergedError if one is not finite."""
        # Recorded before the check, so that the last states show values that are not finite.
        self._rows.append((self._plant.time_s, *self.inputs, torque))
        if not self.drives:
            return
        check_finite("torque in N m", torque, self._plant.time_s)
        self._plant.torque(ARM_JOINTS, torque)

    def exact_torque(self, law: OperationalSpaceLaw) -> np.ndarray:
        """Return the torque (4,) of the exact law at the last observation, in N m."""
        q, dq, hand, target = self.inputs
        return law.torque(q, dq, target - hand)

    def recording(self) -> ArmRecording:
        """Return the observations and torques so far."""
        return ArmRecording.of(self._rows)


class ArmRig(Rig):
    """The robot, anchored, in closed loop by its right arm alone.

    Parameters
    ----------
    plant : Plant
        The robot.
    law : OperationalSpaceLaw
        The exact law; a run starts in its posture at rest.
    dt_s : float, optional
        Time step of the controller; the plant's is a multiple of it, and by default the same.
    """

    def __init__(self, plant: Plant, law: OperationalSpaceLaw, dt_s: float | None = None) -> None:
        self.law = law
        self.aim = TaskAim(plant)
        self.port = ArmPort(plant, self.aim)
        super().__init__(plant, [self.port], dt_s or plant.dt_s)

    def begin(self, seed: int, task: Callable[[np.ndarray], ArmTask]) -> None:
        """Begin a run at rest, as the seed varies it; ``task`` takes the hand's place (3,) in m."""
        plant = self.plant
        rest = zip(ARM_JOINTS, self.law.gains.rest_rad, strict=True)
        plant.reset(seed, posture_rad=dict(rest))
        # Made after the reset: a task begins at the hand's place.
        self.aim.task = task(plant.hand_position())
        self.loop.begin()
