"""The region of states a task of the arm needs, from runs of the exact law."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from spikeport.experiments.arm.port import ArmRig
from spikeport.experiments.arm.recording import ArmRecording, ArmTask
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.region import ArmRegion
from spikeport.robot.plant import Plant
from spikeport.robot.times import PHYSICS_DT_S


class Rehearsal(NamedTuple):
    """A run of the exact law that passes through the states a task needs.

    ``task`` makes the task from the hand's place (3,) at the start; ``seed`` draws the posture.
    """

    task: Callable[[np.ndarray], ArmTask]
    seconds: float
    seed: int


def record_region(law: OperationalSpaceLaw, rehearsals: Iterable[Rehearsal]) -> ArmRegion:
    """Return the region of all states that the exact law passes through in rehearsals."""
    whole = ArmRecording.join(exact_runs(law, rehearsals))
    error = whole.target - whole.hand
    return ArmRegion.from_recording(whole.q, whole.dq, whole.hand, error, seed=0)


def exact_runs(law: OperationalSpaceLaw, rehearsals: Iterable[Rehearsal]) -> list[ArmRecording]:
    """Return the recordings of rehearsals by the exact law.

    The robots step in turn, so that the law is computed for all of them at once: one by one, it
    would take most of the time.
    """
    n_steps = {_begun(law, one): round(one.seconds / PHYSICS_DT_S) for one in rehearsals}
    for step in range(max(n_steps.values())):
        going = [rig for rig, n in n_steps.items() if step < n]
        observed = zip(*(rig.port.inputs for rig in going), strict=True)
        q, dq, hand, target = map(np.array, observed)
        for rig, torque in zip(going, law.torques(q, dq, target - hand), strict=True):
            rig.loop.step(torque)
    return [rig.port.recording() for rig in n_steps]


def _begun(law: OperationalSpaceLaw, rehearsal: Rehearsal) -> ArmRig:
    rig = ArmRig(Plant(anchored=True), law)
    rig.begin(rehearsal.seed, rehearsal.task)
    return rig
