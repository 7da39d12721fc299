"""The walk with a share of its policy's ensembles silenced (the paper's Fig. 5c)."""

import json

import numpy as np
import pytest
import xarray as xr

from spikeport.errors import UsageError
from spikeport.experiments.driver import run
from spikeport.experiments.options import Options
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.trial import WalkTrial


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"silence": 1.5}, "silence=1.5: a share must be from 0 to 1"),
        ({"silence": -0.1}, "silence=-0.1: a share must be from 0 to 1"),
        ({"silence_at": -1.0}, "silence_at=-1: a time must be from 0 on and finite"),
        ({"silence_at": float("nan")}, "silence_at=nan: a time must be from 0 on and finite"),
    ],
)
def test_a_silence_that_makes_no_sense_is_refused(setting, message):
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


@pytest.mark.slow
def test_silence_ends_the_gait(tmp_path, short_gait):
    settings = WalkSettings(
        path="line", n_neurons=4, calibrated=False, silence=1.0, silence_at=0.3, follower="exact"
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
