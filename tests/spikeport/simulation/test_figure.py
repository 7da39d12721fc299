"""The picture of a run: a panel for each probe, with its error."""

import io

import numpy as np
import pytest

from spikeport.counted import percent
from spikeport.plots import plain
from spikeport.simulation import figure as drawing
from spikeport.simulation.figure import figure
from spikeport.simulation.recorded import Recorded


def panels(drawn):
    return [axes for axes in drawn.axes if axes.axison]


def test_every_probe_has_a_panel_with_both_runs_and_the_error(ran):
    drawn = figure(ran.recorded, "native", "my $ model.py")
    drawn.savefig(io.BytesIO(), format="png")  # a dollar sign does not open a formula
    title = "my \\$ model.py\ncolours: native; grey: float Nengo"
    assert drawn.get_suptitle() == title
    for axes, (name, one) in zip(panels(drawn), ran.recorded.items(), strict=True):
        shown = axes.get_title(loc="left")
        assert shown.startswith(f"{plain(name)}: {percent(one.error())} off")
        assert ("with its delay of" in shown) == (one.best_delay() is not None)
        grey, *_, ours = axes.lines
        assert grey.get_color() == drawing.EXACT
        n_points = np.count_nonzero(one.values) if one.spikes else len(one.times_s)
        assert len(ours.get_xdata()) == n_points


@pytest.mark.parametrize(("n", "shape"), [(1, (1, 1)), (13, (7, 2)), (25, (9, 3))])
def test_many_probes_stand_in_columns(n, shape):
    one = Recorded(np.arange(1, 3) * 0.001, np.ones((2, 9)), None, False)
    drawn = figure({f"p{i}": one for i in range(n)}, "native", "model")
    assert len(panels(drawn)) == n
    assert drawn.axes[0].get_gridspec().get_geometry() == shape
    assert panels(drawn)[0].get_title(loc="left") == "p0, the 8 largest of 9 dimensions"
    assert len(panels(drawn)[0].lines) == drawing.LINES
    assert drawn.get_suptitle() == "model\ncolours: native"


def test_the_dimensions_of_the_largest_rms_are_drawn_in_their_order():
    values = np.zeros((2, 20))
    values[:, 10:18] = np.arange(8, 0, -1)
    drawn = figure({"p": Recorded(np.array([0.001, 0.002]), values, None, False)}, "native", "m")
    assert [line.get_ydata()[0] for line in panels(drawn)[0].lines] == [8, 7, 6, 5, 4, 3, 2, 1]


@pytest.mark.parametrize(("n", "marker"), [(1, "o"), (2, "None")])
def test_a_single_sample_is_a_dot(n, marker):
    one = Recorded(np.arange(1, n + 1) * 0.001, np.ones((n, 2)), np.ones((n, 2)), False)
    (axes,) = panels(figure({"p": one}, "native", "model"))
    assert len(axes.lines) == 4
    assert {line.get_marker() for line in axes.lines} == {marker}


def test_a_picture_says_how_many_probes_it_leaves_out(monkeypatch):
    monkeypatch.setattr(drawing, "MOST", 2)
    one = Recorded(np.arange(1, 3) * 0.001, np.ones((2, 1)), None, False)
    drawn = figure({f"p{i}": one for i in range(5)}, "native", "model")
    assert len(panels(drawn)) == 2
    assert drawn.get_suptitle().endswith("; 3 more in probes.nc")
