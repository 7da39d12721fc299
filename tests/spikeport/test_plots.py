"""Names of files and labels in figures are drawn as they are."""

from matplotlib.figure import Figure

from spikeport.plots import plain, rendered


def test_a_name_is_no_formula_and_need_not_be_utf_8():
    figure = Figure()
    figure.suptitle(plain("a$\\frac$\nne\udcff.py"))
    assert figure.get_suptitle() == "a\\$\\frac\\$\nne\\udcff.py"
    assert rendered(figure).startswith(b"\x89PNG")
