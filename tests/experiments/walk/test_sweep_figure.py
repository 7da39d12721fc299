"""Figure of a sweep of the walk: means over the seeds."""

import pytest

from spikeport.experiments.walk import sweep_figure as walk_sweep_figure


def test_the_figure_shows_means_over_the_seeds(finished):
    sweep, folder, made = finished
    drawn = walk_sweep_figure.figure(sweep, folder, made)
    assert [axes.get_ylabel() for axes in drawn.axes] == [
        "path_mse_m2",
        "cross_track_rms_m",
        "falls",
    ]
    assert drawn.axes[-1].get_xlabel() == "n_neurons"
    first, second = drawn.axes[0].lines
    assert first.get_xydata().tolist() == [[2, pytest.approx(2.35)], [20, pytest.approx(20.35)]]
    assert second.get_ydata()[1] == pytest.approx(20.3)  # of the seed that finished
    assert [text.get_text() for text in drawn.axes[0].get_legend().get_texts()] == [
        "reference",
        "native",
    ]
    drawn.savefig(folder.path / "figure.png")


def test_runs_in_which_the_robot_fell_have_no_errors_in_the_figure(finished):
    _, _, made = finished
    shown = walk_sweep_figure.of_walks(made.assign(falls=made["falls"] * 0 + 1))
    assert shown["cross_track_rms_m"].isnull().all()
    assert shown["falls"].sum() == made["falls"].count() > 0
