"""Rows of the robustness table: the default ones, and a user's."""

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.evaluate.rows import MENAGERIE, ROWS, find_rows, name_of
from spikeport.robot.perturbation import Perturbation


def test_the_default_rows_are_distinct_perturbations(monkeypatch):
    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    assert find_rows([]) == ROWS
    assert len(ROWS) == 41  # as docs/walk.md says
    assert len({name_of(row) for row in ROWS}) == len(ROWS)
    for row in ROWS:
        Perturbation(**row)
    monkeypatch.setenv("MENAGERIE_ROOT", "/somewhere")
    assert find_rows([])[-1] == MENAGERIE


def test_a_default_row_has_the_name_that_it_has_if_it_is_asked_for():
    """Two evaluations are compared by the names of their rows."""
    for row in ROWS[1:]:
        text = ",".join(f"{key}={value}" for key, value in row.items())
        assert name_of(find_rows([text])[-1]) == name_of(row)


def test_rows_that_are_asked_for_follow_the_nominal_one():
    rows = find_rows(["terrain=boxes:0.01,push=0.8"])
    assert [name_of(row) for row in rows] == ["nominal", "push=0.8 terrain=boxes:0.01"]


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["speed=1"], "unknown key of a perturbation 'speed'; choose from: action_delay, "),
        (["push=hard"], "--row push=hard: expected a number"),
        (["push"], "--row push: expected KEY=VALUE,KEY=VALUE, found 'push'"),
        (["push=0.3,"], "--row push=0.3,: expected KEY=VALUE,KEY=VALUE, found ''"),
        (["push=1", "push=1.0"], "--row push=1.0: listed twice"),
        (["push=1", "friction=1,push=1"], "--row push=1.0: listed twice"),
        (
            ["push=1", "push=0,friction=1"],
            "--row push=0,friction=1: perturbs nothing, and the row 'nominal' is always there; "
            "cure: leave it out",
        ),
        (["terrain=hills"], "terrain=hills: unknown terrain"),
        (
            ["friction=0.5,push_every=2"],
            "--row friction=0.5,push_every=2: push_every is the time between pushes, and there are "
            "none; cure: push=0.8 beside it, or leave it out",
        ),
    ],
)
def test_rows_that_are_malformed_or_repeated_are_refused(texts, message):
    with pytest.raises(UsageError) as caught:
        find_rows(texts)
    assert str(caught.value).startswith(message)
