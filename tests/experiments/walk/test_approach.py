"""The law that turns first and stands still, where the paper's law circles the reference."""

import numpy as np
import pytest

from spikeport.experiments.policy.settings import load_policy
from spikeport.experiments.walk.approach import TurnFirst
from spikeport.experiments.walk.paths import WalkPath
from spikeport.experiments.walk.port import WalkRig
from spikeport.networks.path_following import FollowerGains, exact_command
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import CONTROL_DT_S

STATE = np.zeros(5)
LAW = np.array([0.8, 0.3])


@pytest.mark.parametrize(("bearing_rad", "share"), [(0.9, 1), (-1.3, 0.5), (1.7, 0), (3.1, 0)])
def test_the_forward_speed_falls_as_the_bearing_of_the_reference_grows(bearing_rad, share):
    place = np.array([np.cos(bearing_rad), np.sin(bearing_rad), 0.5, 0.0])
    limited = TurnFirst().limited(LAW, place, STATE)
    assert limited == pytest.approx([0.8 * share, 0.3])


def test_a_robot_stands_near_a_reference_at_rest_until_it_is_far_from_it():
    approach = TurnFirst()
    distances = [0.3, 0.19, 0.3, 0.41, 0.3]
    speeds = [approach.limited(LAW, np.array([x, 0, 0, 0]), STATE)[0] for x in distances]
    assert speeds == [0.8, 0, 0, 0.8, 0.8]
    assert approach.limited(LAW, np.array([0.1, 0, 0.5, 0]), STATE)[0] == 0.8


def walked(path, seconds, approach):
    """Let the exact controllers follow a path, and return reference minus place (n, 2) in m."""
    plant, policy = Plant(), load_policy()
    rig = WalkRig(plant, None, CONTROL_DT_S, plant.dt_s, approach)
    rig.begin(0, path)
    off = []
    for step in range(round(seconds / plant.dt_s)):
        observed, reference, state = rig.walk.inputs
        if step % 4 == 0:  # the policy observes every 20 ms
            found = policy(observed), exact_command(FollowerGains(), reference, state)
        rig.loop.step(np.concatenate(found))
        assert not rig.loop.over
        off.append(reference[:2] - state[1:3])
    return np.array(off)


def path_of(*rows):
    table = np.array(rows, dtype=float)
    return WalkPath(table[:, 0], table[:, 1:])


STOPS = path_of((0, 0, 0), (4, 2, 0), (60, 2, 0))
STANDS = path_of((0, 0.1, 0.2), (60, 0.1, 0.2))
TURNS_BACK = path_of((0, 0, 0), (4, 2, 0), (60, -26, 0))
BEHIND = path_of((0, -0.4, 0), (60, -24.4, 0))


@pytest.mark.parametrize("path", [STOPS, STANDS], ids=["stops", "stands"])
def test_a_robot_does_not_circle_a_reference_at_rest(path):
    off = walked(path, 14.0, TurnFirst())[-400:]
    assert np.linalg.norm(off, axis=1).max() < 0.4
    assert np.ptp(off, axis=0).max() < 0.1


@pytest.mark.parametrize("path", [TURNS_BACK, BEHIND], ids=["turns back", "behind"])
def test_a_robot_follows_a_reference_that_runs_back(path):
    off = walked(path, 14.0, TurnFirst())[-400:]
    assert np.linalg.norm(off, axis=1).max() < 0.6


def test_the_papers_law_circles_a_reference_at_rest():
    off = walked(STOPS, 14.0, None)[-1000:]
    assert np.ptp(off, axis=0).max() > 1.0
