"""The right arm of the anchored H1 in closed loop with a controller.

Physics runs at 200 Hz with torques held between its steps, the controller at 1 kHz; one after the
other in lock-step, so that a run depends on its seeds alone.
"""

from typing import NamedTuple

import nengo
import numpy as np

from spikeport.errors import DivergedError
from spikeport.experiments.arm.task import Task
from spikeport.networks.arm import STATE_SIZE, ArmNetwork
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.robot.description import ARM_JOINTS
from spikeport.robot.plant import Plant


class Sample(NamedTuple):
    """One physics step. Angles in rad, positions in m, torques in N m."""

    time_s: float
    q: np.ndarray
    dq: np.ndarray
    hand: np.ndarray
    target: np.ndarray
    torque: np.ndarray


class Recording(NamedTuple):
    """All physics steps of a run: as `Sample`, each with n rows."""

    time_s: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    hand: np.ndarray
    target: np.ndarray
    torque: np.ndarray

    @property
    def distance_m(self) -> np.ndarray:
        """(n,) distance of hand and target."""
        return np.linalg.norm(self.target - self.hand, axis=1)

    def at_limit(self, limits_rad: np.ndarray) -> np.ndarray:
        """(n,) whether a joint is at its lowest or highest angle, or pressed beyond; (4, 2)."""
        at_limit = (self.q <= limits_rad[:, 0]) | (self.q >= limits_rad[:, 1])
        return np.asarray(at_limit.any(axis=1))

    def exact_torque(self, law: OperationalSpaceLaw) -> np.ndarray:
        """(n, 4) torque of the exact law at the recorded states, in N m."""
        return law.torques(self.q, self.dq, self.target - self.hand)


class ArmLoop:
    """Plant and task, stepped by the torques of a controller.

    Parameters
    ----------
    law : OperationalSpaceLaw
        The exact law.
    seed : int
        Seed of the initial posture.
    dt_s : float, optional
        Time step of the controller, of which the physics step is a multiple; by default equal.
    appearance : str
        How the robot looks in pictures, see `spikeport.robot.description.load`.

    Attributes
    ----------
    poses : list of array
        MuJoCo's ``qpos`` at every physics step.
    """

    def __init__(
        self,
        law: OperationalSpaceLaw,
        seed: int,
        dt_s: float | None = None,
        appearance: str = "primitive",
    ) -> None:
        self.law = law
        self.plant = Plant(anchored=True, appearance=appearance)
        self._ticks = round(self.plant.dt_s / dt_s) if dt_s else 1
        self.restart(seed)

    def restart(self, seed: int) -> None:
        """Put the arm back to its initial posture, as a seed varies it, and forget the rest."""
        start = dict(zip(ARM_JOINTS, self.law.gains.rest_rad, strict=True))
        self.plant.reset(seed, posture_rad=start)
        self._tick = 0
        self._samples: list[Sample] = []
        self.poses: list[np.ndarray] = []

    def begin(self, task: Task) -> None:
        """Give the arm something to do."""
        self.task = task
        self._observe()

    def _observe(self) -> None:
        self._seen = *self.plant.motion(ARM_JOINTS), self.plant.hand_position(), self.task.target
        self._output = np.concatenate(self._seen)

    @property
    def limits_rad(self) -> np.ndarray:
        """(4, 2) lowest and highest angle of each joint."""
        model = self.plant.model
        return np.array([model.joint(joint).range for joint in ARM_JOINTS])

    def recording(self) -> Recording:
        """What was seen and done so far."""
        return Recording(*(np.array(column) for column in zip(*self._samples, strict=True)))

    def exact_torque(self) -> np.ndarray:
        """(4,) the torque of the exact law at the present state, in N m."""
        q, dq, hand, target = self._seen
        return self.law.torque(q, dq, target - hand)

    def step(self, torque: np.ndarray) -> np.ndarray:
        """One step of the controller: its torque in, [q, dq, x, target] out."""
        self._tick += 1
        if self._tick % self._ticks == 0:
            self._physics(np.array(torque))
        return self._output

    def _physics(self, torque: np.ndarray) -> None:
        self._samples.append(Sample(self.plant.time_s, *self._seen, torque))
        if not np.isfinite(torque).all():
            raise DivergedError(
                f"the controller's torque is {torque.tolist()} N m at {self.plant.time_s:.3f} s, "
                "limit finite numbers; cure: look at its inputs in the last states"
            )
        self.poses.append(self.plant.data.qpos.copy())
        self.plant.torque(ARM_JOINTS, torque)
        self.plant.step()
        self.task.update(self.plant.time_s, self.plant.hand_position())
        self._observe()


def close_loop(controller: ArmNetwork, loop: ArmLoop) -> None:
    """Connect a controller of the current network with the plant, through connections only."""
    plant = nengo.Node(
        lambda _t, torque: loop.step(torque), size_in=4, size_out=STATE_SIZE + 3, label="plant"
    )
    nengo.Connection(plant[:STATE_SIZE], controller.state, synapse=None)
    nengo.Connection(plant[STATE_SIZE:], controller.target, synapse=None)
    nengo.Connection(controller.torque, plant, synapse=None)
