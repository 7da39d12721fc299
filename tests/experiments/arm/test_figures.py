"""Figures of a run of the arm."""

from spikeport.experiments.arm import reach
from tests.helpers.arm_runs import finished


def test_a_joint_at_its_limit_is_marked_in_the_figure():
    def marks(at_limit):
        run = finished([0.3, 0.4], [0.0, 0.0], at_limit)
        result = {
            "settings": {"box": "small"},
            "metrics": {"reaches": 0},
            "seeds": {"run": 0},
            "seconds": 0.01,
            "backend": "analytic",
            "resources": None,
        }
        legend = reach.reach_figure(run, (), result).axes[0].get_legend()
        return [text.get_text() for text in legend.get_texts()]

    assert marks([False, False]) == ["reached below 4 cm"]
    assert marks([False, True]) == ["reached below 4 cm", "joint at its limit (1 steps)"]
