"""Names of files and labels in figures, drawn as they are."""

from matplotlib.figure import Figure

from spikeport.plots import plain, rendered


def test_a_name_in_a_figure_is_not_read_as_a_formula_and_need_not_be_utf_8():
    figure = Figure()
    figure.suptitle(plain("a$\\frac$\nne\udcff.py"))
    assert figure.get_suptitle() == "a\\$\\frac\\$\nne\\udcff.py"
    assert rendered(figure).startswith(b"\x89PNG")
