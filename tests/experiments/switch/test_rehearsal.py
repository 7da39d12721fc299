"""Rehearsals of a schedule: what the policy observes and where the arm goes."""

import numpy as np
import pytest

from spikeport.cache import Cache
from spikeport.experiments.options import Options
from spikeport.experiments.switch import rehearsal
from spikeport.experiments.switch.rehearsal import Rehearsals, Rehearsed
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.networks.region import ArmRegion, Box
from spikeport.robot.description import JOINTS
from spikeport.robot.walk_interface import PARTS


@pytest.mark.slow
@pytest.mark.parametrize(("anchor", "knows"), [(True, False), (False, True)])
def test_a_policy_that_balances_knows_the_arm_at_work(brief, monkeypatch, anchor, knows):
    monkeypatch.setattr(rehearsal, "record_gait", lambda *_asked: np.zeros((1, 69)))
    settings = SwitchSettings(schedule=brief, anchor=anchor)
    trial = SwitchTrial(settings, Options(6.0))
    found = trial.rehearsals(trial.exact()).record()
    elbow = found.observations[:, PARTS["joint angles"]][:, JOINTS.index("right_elbow")]
    assert (np.ptp(elbow) > 0.6) == knows
    assert np.ptp(found.region.q_samples[:, -1]) > 0.6


def test_rehearsals_are_done_once_for_a_schedule(brief, monkeypatch, tmp_path):
    boxes = (Box(np.full(4, i), np.ones(4)) for i in range(4))
    done = Rehearsed(ArmRegion(*boxes, np.eye(4)), np.zeros((1, 69)))
    recorded = []

    def record(_rehearsals):
        recorded.append(done)
        return done

    monkeypatch.setattr(Rehearsals, "record", record)
    options = Options(6.0, cache=Cache(tmp_path / "cache"))
    for digit, n in ((8, 1), (8, 1), (5, 2)):
        trial = SwitchTrial(SwitchSettings(schedule=brief, digit=digit), options)
        found = trial._rehearsed(trial.rehearsals(trial.exact()))
        assert len(recorded) == n
        assert found.arrays().keys() == done.arrays().keys()
        assert all((found.arrays()[name] == a).all() for name, a in done.arrays().items())
