"""The region of states a task of the arm needs, from runs of the exact law."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from spikeport.experiments.arm.port import ArmRig
from spikeport.experiments.arm.recording import ArmRecording, ArmTask
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.region import ArmRegion
from spikeport.robot.plant import Plant


class Rehearsal(NamedTuple):
    """A run of the exact law that passes through the states a task needs.

    ``task`` makes the task from the hand's place (3,) at the start; ``seed`` draws the posture.
    """

    task: Callable[[np.ndarray], ArmTask]
    seconds: float
    seed: int


def record_region(law: OperationalSpaceLaw, rehearsals: Iterable[Rehearsal]) -> ArmRegion:
    """Return the region of all states that the exact law passes through in rehearsals."""
    runs = [exact_run(law, rehearsal) for rehearsal in rehearsals]
    whole = ArmRecording.join(runs)
    error = whole.target - whole.hand
    return ArmRegion.from_recording(whole.q, whole.dq, whole.hand, error, seed=0)


def exact_run(law: OperationalSpaceLaw, rehearsal: Rehearsal) -> ArmRecording:
    """Return the recording of a rehearsal by the exact law."""
    plant = Plant(anchored=True)
    rig = ArmRig(plant, law)
    rig.begin(rehearsal.seed, rehearsal.task)
    for _ in range(round(rehearsal.seconds / plant.dt_s)):
        rig.loop.step(rig.port.exact_torque(law))
    return rig.port.recording()
