"""The examples that are text notebooks: each runs, does what it says, and ends in a picture."""

import re
import runpy
from pathlib import Path
from types import SimpleNamespace

import matplotlib.pyplot as plt
import nengo
import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
CELL = re.compile(r"^# %%( \[markdown\])?$", re.MULTILINE)
pytestmark = [
    pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive"),
    pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning"),
]


def rms(x):
    return np.sqrt(np.mean(np.square(x)))


def late(x, y, steps):
    """Return the relative rms difference of x and y, which comes some steps later."""
    return rms(x[:-steps] - y[steps:]) / rms(x)


def communication_channel(ran):
    data = ran.sim.data
    assert late(data[ran.sent], data[ran.received], 30) < 0.25


def oscillator(ran):
    orbit = ran.sim.data[ran.orbit][500:]
    radius = np.linalg.norm(orbit, axis=1)
    assert 0.8 < radius.min() < radius.max() < 1.4
    turns = np.unwrap(np.arctan2(*orbit.T[::-1]))[[0, -1]] @ [-1, 1] / (2 * np.pi)
    assert turns == pytest.approx(2 * 1.5, rel=0.15)


def basal_ganglia(ran):
    chosen, steps = ran.sim.data[ran.chosen], round(ran.HOLD_S / 0.001)
    ends = chosen[[steps - 1, 2 * steps - 1, 3 * steps - 1]]
    assert ends.argmax(axis=1).tolist() == [0, 1, 2]
    assert np.sort(ends, axis=1)[:, 1].max() < 0.2


def spa_memory(ran):
    apple, pear, plum = ran.similarity[-1]
    assert pear > 0.5
    assert max(abs(apple), abs(plum)) < 0.3


def pes_learning(ran):
    wanted, answered = (ran.sim.data[probe] for probe in (ran.wanted, ran.answered))
    assert late(wanted[:200], answered[:200], 30) > 0.5
    assert late(wanted[700:], answered[700:], 30) < 0.4
    assert ran.sim.activity.totals()["learning_updates"] > 0


def convolution(ran):
    padded = ran.RATE_HZ * ran.image
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3))
    exact = np.einsum("xyij,ijc->xyc", windows, ran.kernels[:, :, 0]).clip(min=0)
    assert rms(ran.maps - exact) < 0.25 * rms(exact)


def converted_policy(ran):
    held = ran.sim.data[ran.model.action][49::50]
    assert rms(held - ran.exact) < 0.2 * rms(ran.exact)


def pole(ran):
    assert np.abs(np.degrees(ran.with_chip)).max() < 7
    assert np.degrees(ran.without[-1]) > 89
    with nengo.Simulator(ran.model, progress_bar=False) as sim:  # its loop has begun
        sim.run_steps(10)
    assert ran.plant.time_s == pytest.approx(0.01)


CHECKS = {
    check.__name__: check
    for check in (
        basal_ganglia,
        communication_channel,
        converted_policy,
        convolution,
        oscillator,
        pes_learning,
        pole,
        spa_memory,
    )
}


def test_every_example_is_checked():
    names = {path.stem for path in EXAMPLES.glob("*.py")} - {"own_robot"}
    assert names == set(CHECKS)


@pytest.mark.slow
@pytest.mark.usefixtures("nengo_defaults")
@pytest.mark.parametrize("name", CHECKS)
def test_an_example_does_what_it_says_and_ends_in_a_picture(name, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    plt.switch_backend("agg")
    plt.close("all")
    ran = SimpleNamespace(**runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__"))
    CHECKS[name](ran)
    assert isinstance(ran.model, nengo.Network)
    (number,) = plt.get_fignums()
    drawn = plt.figure(number).axes
    assert all(axes.has_data() for axes in drawn)
    assert any(axes.get_title() for axes in drawn)
    plt.close("all")


@pytest.mark.parametrize("name", CHECKS)
def test_an_example_is_a_text_notebook(name):
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    assert text.startswith("# %% [markdown]\n# # ")
    kinds = [bool(kind) for kind in CELL.findall(text)]
    assert len(kinds) >= 3
    assert not kinds[-1]
    assert text.endswith("plt.show()\n")
    for markdown, cell in zip(kinds, CELL.split(text)[2::2], strict=True):
        lines = cell.strip().splitlines()
        assert not markdown or all(line.startswith("#") for line in lines)
