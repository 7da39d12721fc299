"""The region of states a task of the arm needs, from runs of the exact law."""

from collections.abc import Iterable

import numpy as np

from spikeport.experiments.arm.loop import ArmLoop, Recording
from spikeport.experiments.arm.task import Rehearsal
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.region import ArmRegion


def record_region(law: OperationalSpaceLaw, rehearsals: Iterable[Rehearsal]) -> ArmRegion:
    """The region of everything that happens while the exact law does the rehearsals."""
    runs = [_exact_run(law, rehearsal) for rehearsal in rehearsals]
    whole = Recording(*(np.concatenate(column) for column in zip(*runs, strict=True)))
    error = whole.target - whole.hand
    return ArmRegion.from_recording(whole.q, whole.dq, whole.hand, error, seed=0)


def _exact_run(law: OperationalSpaceLaw, rehearsal: Rehearsal) -> Recording:
    loop = ArmLoop(law, rehearsal.seed)
    loop.begin(rehearsal.task(loop.plant.hand_position()))
    for _ in range(round(rehearsal.seconds / loop.plant.dt_s)):
        loop.step(loop.exact_torque())
    return loop.recording()
