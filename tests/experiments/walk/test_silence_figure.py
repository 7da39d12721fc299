"""The walk with a share of its policy's ensembles silenced (the paper's Fig. 5c)."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from spikeport.errors import UsageError
from spikeport.experiments.driver import run
from spikeport.experiments.options import Options
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.silence_figure import silence_figure
from spikeport.experiments.walk.trial import WalkTrial
from spikeport.robot.walk_interface import gravity


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"silence": 1.5}, "silence=1.5: a share must be from 0 to 1"),
        ({"silence": -0.1}, "silence=-0.1: a share must be from 0 to 1"),
        ({"silence_at": -1.0}, "silence_at=-1: a time must be from 0 on and finite"),
        ({"silence_at": float("nan")}, "silence_at=nan: a time must be from 0 on and finite"),
    ],
)
def test_a_silenced_share_or_a_time_out_of_range_is_refused(setting, message):
    with pytest.raises(UsageError) as caught:
        WalkSettings(**setting)
    assert str(caught.value) == message


@pytest.mark.parametrize(("backend", "policy"), [("analytic", "spiking"), ("native", "mlp")])
def test_the_exact_policy_cannot_be_silenced(backend, policy):
    options = Options(0.1, backend=backend, pipeline="compact")
    settings = WalkSettings(silence=0.5, policy=policy, follower="exact")
    with pytest.raises(UsageError) as caught:
        WalkTrial(settings, options).check()
    assert str(caught.value) == "silence=0.5: the exact policy has no neurons"


@pytest.mark.parametrize(
    ("tilt", "axis", "degrees"),
    [("pitch", (0, 1, 0), 20), ("pitch", (0, 1, 0), -5), ("roll", (1, 0, 0), 20)],
)
def test_tilts_are_positive_forwards_and_to_the_right(tilt, axis, degrees):
    """The x axis of a robot points ahead, its y axis to the left; a roll lowers the right side."""
    half = np.radians(degrees) / 2
    down = gravity([np.cos(half), *np.sin(half) * np.array(axis)])
    run = SimpleNamespace(
        recording=SimpleNamespace(
            time_s=np.array([0.005, 0.01]), height_m=np.ones(2), down=np.tile(down, (2, 1))
        ),
        fallen_at_s=None,
    )
    result = {
        "settings": {"path": "line", "silence": 0.5, "silence_at": 0.0},
        "backend": "native",
    }
    axes = silence_figure(run, np.zeros((10, 3)), result).axes[-1]
    drawn = {line.get_label(): line.get_ydata() for line in axes.lines[:2]}
    assert drawn.keys() == {"pitch", "roll"}
    for name, values in drawn.items():
        assert values == pytest.approx(degrees if name == tilt else 0.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.usefixtures("short_gait")
def test_silence_ends_the_gait(tmp_path, pocket):
    settings = WalkSettings(
        path="line",
        policy=pocket,
        n_neurons=4,
        calibrated=False,
        silence=1.0,
        silence_at=0.3,
        follower="exact",
    )
    options = Options(0.5, backend="native", pipeline="compact")
    run(WalkTrial(settings, options), tmp_path)
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "result.json").read_text())["settings"]["silence"] == 1.0
    with xr.open_dataset(tmp_path / "probes.nc", engine="h5netcdf") as probes:
        times = probes.policy_time.values
        late = probes.time.values > 0.4
        action = probes.action.values[late]
    assert len(times) > 1000
    assert times.max() < 0.32
    assert np.ptp(action, axis=0).max() < 0.01
