"""The order of an evaluation's episodes."""

from spikeport.experiments.evaluate.plan import EvaluationSweep


def test_every_row_runs_with_a_seed_before_any_runs_with_the_next():
    evaluation = object.__new__(EvaluationSweep)
    object.__setattr__(evaluation, "rows", ({}, {"push": 0.8}))
    object.__setattr__(evaluation, "seeds", (5, 6))
    places = [point.place for point in evaluation.points()]
    assert places == [{"seed": 5}, {"push": 0.8, "seed": 5}, {"seed": 6}, {"push": 0.8, "seed": 6}]
