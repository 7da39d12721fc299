"""The marks in pictures of a walk."""

import numpy as np
import pytest

from spikeport.experiments.walk.marks import REFERENCE_M, walk_marks
from spikeport.robot.terrain import find_terrain
from tests.helpers.walk_runs import walked


@pytest.mark.parametrize("terrain", ["flat", "slope:6", "relief:0.1"])
def test_marks_lie_on_the_floor(terrain):
    floor = find_terrain(terrain)
    marks = walk_marks(walked(4.0)._replace(floor=floor))(400)
    assert marks[0].radius_m == REFERENCE_M
    assert len(marks) > 20
    x, y, z = np.array([mark.position_m for mark in marks]).T
    radii_m = [mark.radius_m for mark in marks]
    np.testing.assert_allclose(z - radii_m, floor.height_m(x, y), atol=1e-12)
