"""Rehearsals of a schedule: what the policy observes and where the arm goes."""

import numpy as np
import pytest

from spikeport.experiments.options import Options
from spikeport.experiments.switch import rehearsal
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.robot.description import JOINTS
from spikeport.robot.walk_interface import PARTS


@pytest.mark.slow
@pytest.mark.parametrize(("anchor", "told"), [(True, False), (False, True)])
def test_a_policy_that_balances_knows_the_arm_at_work(brief, monkeypatch, anchor, told):
    monkeypatch.setattr(rehearsal, "record_gait", lambda policy: np.zeros((1, 69)))
    settings = SwitchSettings(schedule=brief, anchor=anchor)
    trial = SwitchTrial(settings, Options(6.0))
    found = trial.rehearsals(trial.exact()).record()
    elbow = found.observations[:, PARTS["joint angles"]][:, JOINTS.index("right_elbow")]
    assert (np.ptp(elbow) > 0.6) == told
    assert np.ptp(found.region.q_samples[:, -1]) > 0.6
