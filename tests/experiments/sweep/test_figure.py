"""Figures of a sweep: means over the seeds."""

from spikeport.experiments.sweep import figure as sweep_figure
from spikeport.experiments.sweep.folder import PointFiles, SweepFolder
from spikeport.experiments.sweep.table import table, write_table
from spikeport.plots import rendered
from tests.helpers.sweeps import finish, result


def test_a_third_setting_makes_columns_and_texts_label_the_axis(sweep_of, tmp_path):
    varied = {"policy": ("mlp", "spiking"), "speed": (0.4, 0.5), "backend": ("reference", "native")}
    sweep = sweep_of(varied=varied)
    folder = SweepFolder(tmp_path)
    for point in sweep.points():
        finish(folder, point, falls=0)
    drawn = sweep_figure.figure(sweep, folder, table(sweep, folder))
    assert [axes.get_title() for axes in drawn.axes] == ["backend=reference", "backend=native"]
    assert [label.get_text() for label in drawn.axes[0].get_xticklabels()] == ["mlp", "spiking"]
    assert [line.get_label() for line in drawn.axes[1].lines] == ["0.4", "0.5"]


def test_a_sweep_over_seeds_alone_is_drawn_over_them(sweep_of, tmp_path):
    sweep = sweep_of(varied={}, seeds=(0, 1))
    folder = SweepFolder(tmp_path)
    for point, error in zip(sweep.points(), (0.1, 30.0), strict=True):
        finish(folder, point, path_mse_m2=error)
    (axes,) = sweep_figure.figure(sweep, folder, table(sweep, folder)).axes
    assert axes.lines[0].get_xydata().tolist() == [[0, 0.1], [1, 30.0]]
    assert axes.get_yscale() == "log"


def test_numbers_are_drawn_in_rising_order_however_they_were_typed(sweep_of, tmp_path):
    sweep, folder = sweep_of(varied={"n_neurons": (20, 2, 6)}), SweepFolder(tmp_path)
    for point in sweep.points():
        finish(folder, point, falls=point.place["n_neurons"] / 10)
    (axes,) = sweep_figure.figure(sweep, folder, table(sweep, folder)).axes
    assert axes.lines[0].get_xydata().tolist() == [[2, 0.2], [6, 0.6], [20, 2.0]]


def test_large_seeds_are_labelled_with_all_their_digits(sweep_of, tmp_path):
    varied = {"speed": (0.1, 0.5), "network_seed": (1234567, 1234568)}
    sweep, folder = sweep_of(varied=varied), SweepFolder(tmp_path)
    for point in sweep.points():
        finish(folder, point, falls=0)
    (axes,) = sweep_figure.figure(sweep, folder, table(sweep, folder)).axes
    assert [line.get_label() for line in axes.lines] == ["1234567", "1234568"]


def test_a_title_says_how_long_points_last(sweep_of, tmp_path):
    schedules = ("switch", "free-standing")
    sweep = sweep_of(experiment="switch", seconds=60.0, settings={}, varied={"schedule": schedules})
    folder = SweepFolder(tmp_path)
    for point in sweep.points():
        folder.write(point, PointFiles({**result(point, falls=0), "seconds": point.seconds}, None))
    drawn = sweep_figure.figure(sweep, folder, table(sweep, folder))
    assert drawn.get_suptitle() == "switch on native, 26 or 40 s, seeds: 1"


def test_values_are_not_drawn_as_formulas_and_need_not_be_utf_8(sweep_of, tmp_path):
    policies = ("a$\\frac$.npz", "p\udcff.npz")
    sweep, folder = sweep_of(varied={"policy": policies}), SweepFolder(tmp_path)
    for point in sweep.points():
        finish(folder, point, falls=0)
    found = table(sweep, folder)
    write_table(folder, found)
    drawn = sweep_figure.figure(sweep, folder, found)
    rendered(drawn)
    names = [label.get_text() for label in drawn.axes[0].get_xticklabels()]
    assert names == ["a\\$\\frac\\$.npz", "p\\udcff.npz"]


def test_a_figure_of_many_panels_says_how_many_are_left_out(sweep_of, tmp_path):
    varied = {"speed": (0.1,), "ramp": (0.0,), "network_seed": tuple(range(50))}
    sweep, folder = sweep_of(varied=varied), SweepFolder(tmp_path)
    for point in sweep.points():
        finish(folder, point, falls=0, path_mse_m2=1.0)
    drawn = sweep_figure.figure(sweep, folder, table(sweep, folder))
    assert len(drawn.axes) == sweep_figure.MOST_PANELS
    assert drawn.get_suptitle().endswith("; 40 panels left out")
