import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.experiments.arm import reachability
from spikeport.experiments.arm.reach_task import BOXES
from spikeport.experiments.arm.reachability import (
    check_in_region,
    check_reachable,
    nearest_reachable,
)
from spikeport.networks.region import ArmRegion, Box
from spikeport.robot.arm import ArmDynamics


@pytest.mark.slow
def test_a_reachable_point_is_its_own_nearest_point():
    arm = ArmDynamics()
    low, high = arm.limits_rad.T
    q = np.random.RandomState(0).uniform(0.3, 0.7, (20, 4)) * (high - low) + low
    points = arm.batch(q).position
    assert np.array(list(nearest_reachable(points))) == pytest.approx(points, abs=1e-3)


def test_few_points_of_a_box_take_a_search(monkeypatch):
    """Searches for all points would take most of the time of a check."""
    searched, search = [], reachability._least_gap

    def counted(arm, point, *found):
        searched.append(point)
        return search(arm, point, *found)

    monkeypatch.setattr(reachability, "_least_gap", counted)
    points = BOXES["small"].grid(3)
    assert np.array(list(nearest_reachable(points))) == pytest.approx(points, abs=1e-3)
    assert len(searched) < 0.1 * len(points)


@pytest.mark.slow
def test_the_nearest_point_to_a_far_one_lies_in_its_direction():
    shoulder = np.array([0.0, -0.2135, 1.4989])
    far = shoulder + np.array([3.0, 0.0, -3.0])
    (nearest,) = nearest_reachable(far[np.newaxis])
    assert 0.4 < np.linalg.norm(nearest - shoulder) < 0.7
    assert np.linalg.norm(nearest - far) < np.linalg.norm(shoulder - far)
    assert nearest[0] > 0.2
    assert nearest[2] < 1.3


@pytest.mark.parametrize("box", BOXES.values(), ids=BOXES)
def test_every_target_of_the_boxes_is_within_reach(box):
    check_reachable("box", box.grid(2))


@pytest.mark.slow
def test_the_first_point_out_of_reach_is_named_with_the_nearest_one():
    points = np.array([[0.35, -0.2, 1.2], [2.0, -0.2, 1.2], [3.0, -0.2, 1.2]])
    (nearest,) = nearest_reachable(points[1:2])
    away_cm = 100 * np.linalg.norm(nearest - points[1])
    with pytest.raises(UsageError) as caught:
        check_reachable("digit 5", points)
    assert str(caught.value) == (
        f"digit 5: (2.000, -0.200, 1.200) m is out of reach of the right arm, by {away_cm:.1f} cm; "
        f"the nearest point inside is ({nearest[0]:.3f}, {nearest[1]:.3f}, {nearest[2]:.3f}) m; "
        "cure: move the goal there, or make it smaller"
    )


def test_a_point_out_of_the_sampled_region_is_named_with_the_nearest_one():
    unit = Box(np.zeros(3), np.ones(3))
    region = ArmRegion(q=unit, dq=unit, x=unit, error=unit, q_samples=np.zeros((1, 4)))
    check_in_region("box", np.array([[1.0, -1.0, 0.5]]), region)
    with pytest.raises(UsageError) as caught:
        check_in_region("box", np.array([[0.0, 0.0, 0.0], [1.5, 0.0, -1.0]]), region)
    assert str(caught.value) == (
        "box: (1.500, 0.000, -1.000) m is out of the region the network is made for, by 50.0 cm; "
        "the nearest point inside is (1.000, 0.000, -1.000) m; cure: move the goal there, or make "
        "it smaller"
    )
