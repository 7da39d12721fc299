"""Rehearsals of a schedule: the observations of the policy and the region of the arm."""

import dataclasses

import numpy as np
import pytest

from spikeport.cache import Cache
from spikeport.errors import UsageError
from spikeport.experiments.arm.draw_task import Sheet
from spikeport.experiments.options import Options
from spikeport.experiments.switch import rehearsal
from spikeport.experiments.switch.goals import BOX
from spikeport.experiments.switch.rehearsal import Rehearsals, Rehearsed
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.networks import walking_policy
from spikeport.networks.region import ArmRegion, Box
from spikeport.robot.description import JOINTS
from spikeport.robot.walk_interface import PARTS


@pytest.mark.slow
@pytest.mark.parametrize(("anchor", "knows"), [(True, False), (False, True)])
def test_only_a_policy_that_balances_observes_the_arm_at_work(brief, monkeypatch, anchor, knows):
    monkeypatch.setattr(rehearsal, "record_gait", lambda *_asked: np.zeros((1, 69)))
    monkeypatch.setattr(rehearsal, "SEEDS", (1000,))
    monkeypatch.setattr(Rehearsals, "_reaches", lambda _: [])
    settings = SwitchSettings(schedule=brief, anchor=anchor)
    trial = SwitchTrial(settings, Options(6.0))
    found = trial.rehearsals(trial.exact()).record()
    elbow = found.observations[:, PARTS["joint angles"]][:, JOINTS.index("right_elbow")]
    assert (np.ptp(elbow) > 0.6) == knows
    assert np.ptp(found.region.q_samples[:, -1]) > 0.6


@pytest.fixture
def region(tmp_path, phases, monkeypatch):
    """Return a function that rehearses phases, and returns the region of the arm."""
    monkeypatch.setattr(rehearsal, "record_gait", lambda *_asked: np.zeros((1, 69)))
    monkeypatch.setattr(rehearsal, "SEEDS", (1000,))

    def rehearsed(seconds, goal, digit=8):
        file = tmp_path / "schedule.toml"
        file.write_text(phases((seconds, goal)))
        trial = SwitchTrial(SwitchSettings(schedule=str(file), digit=digit), Options(seconds))
        return trial.rehearsals(trial.exact()).record().region

    return rehearsed


@pytest.mark.slow
def test_a_short_phase_that_reaches_is_rehearsed_in_the_whole_box(region):
    corners = BOX.grid(2)
    assert (np.abs(region(0.5, 'arm = "reach"').x.normalise(corners)) < 1).all()


@pytest.mark.slow
def test_the_region_holds_the_strokes_whose_corners_a_fast_hand_cuts(region):
    stroke = Sheet().stroke(4)
    assert region(4, 'arm = "digit"', 4).x.clip(stroke) == pytest.approx(stroke)


def test_a_robot_that_falls_before_its_arm_works_is_refused(brief, tmp_path):
    weights = walking_policy.load()
    *hidden, last = weights.biases
    squat = np.where(["knee" in joint for joint in JOINTS], 4.0, 0.0)
    dataclasses.replace(weights, biases=(*hidden, last + squat)).save(tmp_path / "squats.npz")
    settings = SwitchSettings(schedule=brief, policy=str(tmp_path / "squats.npz"))
    trial = SwitchTrial(settings, Options(6.0))
    with pytest.raises(UsageError, match=r"fall at 0\.\d s, before the arm works; cure: "):
        trial.rehearsals(trial.exact()).record()


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
