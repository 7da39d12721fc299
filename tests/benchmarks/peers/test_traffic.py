"""The time of a step, by the difference of a long run and a short one."""

import importlib
from pathlib import Path

import peers
import pytest


@pytest.fixture
def traffic(monkeypatch):
    """Return the module that contestants import."""
    monkeypatch.syspath_prepend(str(Path(peers.__file__).parent / "peers"))
    return importlib.import_module("traffic")


@pytest.mark.parametrize("constant_s", [0.0, 0.131, 5.0])
def test_the_constant_part_of_a_call_does_not_count(traffic, constant_s):
    now_s = [0.0]

    def run(steps):
        now_s[0] += constant_s + steps * 1e-4

    assert traffic.step_s(run, lambda: now_s[0]) == pytest.approx(1e-4)


def test_a_median_of_rounds_leaves_out_one_that_was_disturbed(traffic):
    now_s, calls = [0.0], []

    def run(steps):
        calls.append(steps)
        now_s[0] += steps * 0.1 + (50.0 if len(calls) == 3 else 0.0)

    assert traffic.step_s(run, lambda: now_s[0]) == pytest.approx(0.1)
    assert calls == [100, *(10, 100) * traffic.ROUNDS]
