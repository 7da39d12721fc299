"""Command-line arguments that would end in a traceback, or be ignored."""

import sys

import compile_versions
import estimators
import first_step
import growth
import learning
import link
import policy_conversion
import pytest
import robot_faults
import scale
import scattered
import speed
import sweep_points
import versions


@pytest.mark.parametrize(
    ("script", "words"),
    [
        (speed, ["--rounds", "0"]),
        (learning, ["--rounds", "0"]),
        (scattered, ["--rounds", "0"]),
        (scattered, ["--neurons", "0"]),
        (estimators, ["--seeds", "0"]),
        (link, ["image.npz", "--steps", "0"]),
        (link, ["image.npz", "--rounds", "0"]),
        (policy_conversion, ["--seeds", "0"]),
        (sweep_points, ["--n-neurons", "0"]),
        (scale, ["--rounds", "0"]),
        (first_step, ["--n-neurons", "0"]),
        (growth, ["--n", "0"]),
        (robot_faults, ["analytic", "--seeds", "0"]),
        (versions, [".", "--blocks", "0"]),
        (compile_versions, [".", "--times", "0"]),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_zero_is_refused(script, words, monkeypatch, capsys):
    monkeypatch.setattr(versions, "site", str)
    with pytest.raises(SystemExit) as ended:
        run(script, words, monkeypatch)
    assert ended.value.code == 2
    assert ": 0 is less than " in capsys.readouterr().err


@pytest.mark.parametrize("n", [512, 1000, 1025])
def test_sizes_that_no_chain_has_are_refused(n, monkeypatch, capsys):
    with pytest.raises(SystemExit):
        run(scale, ["--n", str(n)], monkeypatch)
    assert f"{n} is no multiple of 512 from 1024 on" in capsys.readouterr().err
    assert [scale.size(text) for text in ("0", "1024", "4096")] == [0, 1024, 4096]


def test_a_plan_that_does_not_exist_is_refused(monkeypatch, capsys):
    with pytest.raises(SystemExit) as ended:
        run(robot_faults, ["analytic", "--only", "dely"], monkeypatch)
    assert ended.value.code == 2
    assert "--only dely: no plan begins so; choose from: none, delay=10:1, " in (
        capsys.readouterr().err
    )


def run(script, words, monkeypatch):
    """Run a script as a command."""
    monkeypatch.setattr(sys, "argv", [script.__name__, *words])
    script.main()
