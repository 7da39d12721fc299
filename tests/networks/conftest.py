"""The exact law of the arm, and the region the reach task needs in its small box."""

import pytest

from spikeport.cache import Arrays, Cache
from spikeport.experiments.arm.reach_task import BOXES, rehearsals
from spikeport.experiments.arm.region import record_region
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.region import ArmRegion
from spikeport.robot.arm import ArmDynamics


@pytest.fixture(scope="session")
def law() -> OperationalSpaceLaw:
    return OperationalSpaceLaw(ArmDynamics())


@pytest.fixture(scope="session")
def region(law: OperationalSpaceLaw, kept: Cache) -> ArmRegion:
    def rehearse() -> Arrays:
        return record_region(law, rehearsals(BOXES["small"])).arrays()

    # With the inputs of the reach task, whose tests keep the same rehearsal.
    inputs = {"experiment": "reach", "box": BOXES["small"]}
    return ArmRegion.of(kept.kept("rehearsal", inputs, rehearse))
