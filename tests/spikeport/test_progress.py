"""Stages of work, each reported when it begins."""

import pytest

from spikeport.progress import Stages


def test_a_stage_is_reported_with_the_share_that_is_done_before_it():
    reported = []
    stages = Stages(lambda *one: reported.append(one), "compiling", ["build", "pack", "verify"])
    for name in ("build", "verify"):
        stages.begin(name)
    assert reported == [("compiling: build", 0.0), ("compiling: verify", pytest.approx(2 / 3))]
