import pytest
from matplotlib.figure import Figure

from spikeport.experiments.switch.metrics import phase_metrics
from spikeport.experiments.switch.work_figure import draw_work


@pytest.mark.parametrize(
    ("arm", "made_up", "title", "n_lines", "n_circles"),
    [
        ("digit", {"off_m": 0.005, "read_as": 8}, "5.0 mm rms from template\nread as 8", 2, 0),
        ("digit", {"off_m": 0.005}, "5.0 mm rms from template", 2, 0),
        ("reach", {"jumps": 3}, "3 targets reached", 1, 4),
        ("retract", {}, "", 0, 0),
    ],
)
def test_the_work_of_the_arm_is_drawn_by_its_kind(worked, arm, made_up, title, n_lines, n_circles):
    run, axes = worked(arm, **made_up), Figure().add_subplot()
    draw_work(axes, run, phase_metrics(run))
    assert axes.get_title() == title
    assert (len(axes.lines), len(axes.patches)) == (n_lines, n_circles)
    assert axes.axison == bool(title)
