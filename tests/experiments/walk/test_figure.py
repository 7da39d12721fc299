"""The figure of a walking run."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.experiments.walk.figure import walk_figure
from tests.helpers.walk_runs import walked

RESULT = {
    "settings": {"path": "line"},
    "metrics": {"falls": 0, "cross_track_rms_m": 0.1},
    "seeds": {"run": 0},
    "seconds": 4.0,
    "backend": "native",
    "resources": None,
}


@pytest.mark.parametrize(
    ("foot", "seen"), [("left foot", [True, False]), ("right foot", [False, True])]
)
def test_each_foots_bar_is_dark_while_it_is_on_the_floor(foot, seen):
    run = walked(4.0)
    first = run.recording.time_s < 2.0  # on the left foot, then on the right
    recording = dataclasses.replace(run.recording, on_floor=np.stack((first, ~first), axis=1))
    axes = walk_figure(run._replace(recording=recording), (), RESULT).axes[-1]
    labels = [label.get_text() for label in axes.get_yticklabels()]
    height = axes.get_yticks()[labels.index(foot)]
    places = axes.transData.transform([(1.0, height), (3.0, height)])
    (image,) = axes.images
    # Matplotlib itself finds the value at a place, as it shows it under a mouse.
    pointers = [SimpleNamespace(x=x, y=y) for x, y in places]
    assert [image.get_cursor_data(pointer) for pointer in pointers] == seen
    assert image.get_cmap()(1.0)[:3] == (0, 0, 0)
