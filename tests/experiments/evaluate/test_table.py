"""The robustness table of finished episodes."""

from pathlib import Path

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.evaluate.measures import MEASURES
from spikeport.experiments.evaluate.table import as_json, markdown, table


class Kept:
    """A folder of episodes, by their row's name and seed."""

    def __init__(self, metrics):
        self._metrics = metrics

    def holds(self, point):
        return point in self._metrics

    def read(self, point):
        return {"metrics": self._metrics[point]}

    def result_path(self, point):
        return Path("-".join(map(str, point)) + ".json")


class Asked:
    """An evaluation whose points are pairs of row and seed."""

    rows = ({}, {"push": 0.8}, {"friction": 0.2})
    seeds = (0, 1)

    def point(self, row, seed):
        return (*row, seed)


def walked(falls, **figures):
    return {"falls": falls, **dict.fromkeys(MEASURES), **figures}


@pytest.fixture
def rows():
    kept = {
        (0,): walked(0, clearance_m=0.10),
        (1,): walked(0, clearance_m=0.12),
        ("push", 0): walked(1),
    }
    return table(Asked(), Kept(kept))


def test_rows_without_an_episode_are_not_left_out(rows):
    assert [row.name for row in rows] == ["nominal", "push=0.8", "friction=0.2"]
    assert [row.fallen for row in rows] == ["0 of 2", "1 of 1", "0 of 0"]
    assert as_json(rows)[2]["fell"] is None
    assert "| friction=0.2 | 0 of 0 | - | - |" in markdown(rows)
    assert table(Asked(), Kept({})) == []


def test_each_estimate_is_followed_by_its_interval(rows):
    nominal, pushed, _, _, *definitions = markdown(rows).splitlines()[2:]
    assert nominal.startswith("| nominal | 0 of 2 | 0-66 % | - |")
    assert "| 0.110 ± 0.127 |" in nominal  # t of one degree of freedom: 12.7 times 0.01
    assert pushed.startswith("| push=0.8 | 1 of 1 | 21-100 % | - |")
    assert definitions[-1] == (
        "- *cost of transport* (`cost_of_transport`): positive work of the joints, divided by "
        "weight and distance, while the robot is commanded to move ahead"
    )


def test_json_has_the_perturbation_and_every_figure(rows):
    nominal, pushed, _ = as_json(rows)
    assert nominal["clearance_m"]["estimate"] == pytest.approx(0.11)
    assert pushed["perturbation"] == {"push": 0.8}
    assert pushed["falls"] == 1
    assert set(MEASURES) <= set(pushed)


ALTERED = [
    {},
    {"falls": 0},
    walked("no"),
    walked(2),
    walked(0, clearance_m="high"),
    walked(0, clearance_m=float("nan")),
]


@pytest.mark.parametrize("metrics", ALTERED, ids=str)
def test_the_error_of_an_altered_episode_names_its_file(metrics):
    with pytest.raises(UsageError, match=r"^1\.json: holds no figures of an episode; remove it"):
        table(Asked(), Kept({(0,): walked(0), (1,): metrics}))
