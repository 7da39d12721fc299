"""The comparison of two robustness tables."""

import json

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.evaluate import comparison
from spikeport.experiments.evaluate.comparison import compare, is_evaluation
from spikeport.experiments.evaluate.interval import Interval, of_share
from spikeport.experiments.evaluate.table import TableRow
from spikeport.files import write_json
from tests.helpers.evaluations import write_evaluation


def mean(estimate, half, n=20):
    bounds = (None, None) if half is None else (estimate - half, estimate + half)
    return Interval(estimate, *bounds, n)


def row(perturbation, falls=0, n=20, **means):
    return TableRow(perturbation, falls, of_share(falls, n), means)


@pytest.fixture
def kept(tmp_path):
    """Return a function that keeps rows as an evaluation's result, and returns the file."""

    def keep(name, *rows, **settings):
        return write_evaluation(tmp_path / f"{name}.json", *rows, **settings)

    return keep


def test_equal_evaluations_do_not_differ(kept):
    rows = row({}, clearance_m=mean(0.1, 0.01)), row({"push": 0.8}, 10)
    comparison = compare(kept("a", *rows, policy="mlp"), kept("b", *rows, policy="mlp"))
    assert comparison.differences == []
    assert comparison.compared == 3


def test_falls_differ_if_fishers_test_says_so(kept):
    # Four of eight robots may fall in 70 ways, 2 of which are as unequal: p = 2 / 70. With 3
    # of 6 robots, it is 2 of 20 ways.
    a = kept("a", row({}, 0, 4), row({"push": 0.8}, 0, 3))
    b = kept("b", row({}, 4, 4), row({"push": 0.8}, 3, 3))
    assert compare(a, b) == ([("nominal: falls", "0 of 4", "4 of 4", "p = 0.029")], 2)


def test_means_differ_beyond_the_interval_of_their_difference(kept):
    # sqrt(0.003² + 0.004²) = 0.005
    a = kept("a", row({}, speed_error_m_s=mean(0.020, 0.003), slip_m_s=mean(0.020, 0.003)))
    b = kept("b", row({}, speed_error_m_s=mean(0.026, 0.004), slip_m_s=mean(0.024, 0.004)))
    (found,) = compare(a, b).differences
    assert found == (
        "nominal: speed_error_m_s",
        "0.020 ± 0.003",
        "0.026 ± 0.004",
        "+0.006 ± 0.005",
    )
    assert [one.change for one in compare(b, a).differences] == ["-0.006 ± 0.005"]


def test_a_figure_without_an_interval_is_not_compared(kept):
    a = kept("a", row({}, slip_m_s=mean(0.1, None, 1), steps_per_s=None, impact_bw=mean(2, 0.1)))
    b = kept("b", row({}, slip_m_s=mean(0.9, 0.01), steps_per_s=mean(3, 0.1)))
    assert compare(a, b) == ([], 1)


def test_a_row_without_an_episode_has_no_falls_to_compare(kept):
    empty = TableRow({}, 0, None, {})
    assert compare(kept("a", empty), kept("b", row({}, 20))) == ([], 0)


def test_settings_and_rows_of_one_evaluation_are_listed(kept):
    a = kept("a", row({}), row({"mass": 1.1}), policy="mlp", n_neurons=4)
    b = kept("b", row({"push": 0.8}, 3), row({}), n_neurons=20)
    assert [one[:3] for one in compare(a, b).differences] == [
        ("policy", "mlp", "-"),
        ("n_neurons", "4", "20"),
        ("mass=1.1", "0 of 20 fell", "-"),
        ("push=0.8", "-", "3 of 20 fell"),
    ]


def test_files_seeds_and_versions_that_differ_are_listed(kept):
    paths = [kept(name, row({})) for name in "ab"]
    for path, digest, seeds in zip(paths, ("12ab", "34cd"), ([0, 1, 2], [5]), strict=True):
        held = {"files": {"p.npz": digest}, "seeds": seeds, "versions": {"numpy": digest[:2]}}
        write_json(path, {**json.loads(path.read_text()), **held, "chip": "loihi"})
    assert [one[:3] for one in compare(*paths).differences] == [
        ("seeds", "0 to 2", "5 to 5"),
        ("digest of p.npz", "12ab", "34cd"),
        ("version of numpy", "12", "34"),
    ]


def test_only_results_of_evaluations_are_recognised(kept, tmp_path):
    assert is_evaluation(kept("a", row({})))
    for content in ([], {"experiment": "walk"}, {"experiment": 3}, {}):
        write_json(tmp_path / "other.json", content)
        assert not is_evaluation(tmp_path / "other.json")


def test_more_falls_than_episodes_are_refused(kept):
    path = kept("a", row({}))
    path.write_text(path.read_text().replace('"falls": 0', '"falls": 21'))
    with pytest.raises(UsageError, match="21 falls in 20 episodes"):
        compare(path, path)


def test_a_figure_of_one_episode_is_written_without_an_interval():
    assert comparison.Estimate(estimate=0.1, low=None, high=None, n=1).text == "0.100"
    assert comparison.Estimate(estimate=0.1, low=0.05, high=0.15, n=2).text == "0.100 ± 0.050"
