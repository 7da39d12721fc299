"""Experiments on a board's stub: the figures of native, and damping when the board is lost."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from spikeport.backends.board.link import LinkOptions
from spikeport.cache import Cache
from spikeport.errors import BoardLostError
from spikeport.experiments import registry
from spikeport.experiments.options import Options


def reach(
    folder: Path, seconds: float, backend: str, link: LinkOptions, kept: Cache
) -> dict[str, object]:
    experiment = registry.get("reach")
    folder.mkdir()
    options = Options(seconds=seconds, backend=backend, link=link, cache=kept)
    return experiment.run(experiment.settings(), options, folder).result


@pytest.mark.slow
def test_a_reach_on_the_stub_equals_one_on_the_native_backend(tmp_path: Path, kept: Cache) -> None:
    found = {
        backend: reach(tmp_path / backend, 0.3, backend, LinkOptions(), kept)
        for backend in ("native", "board")
    }
    one, other = (xr.open_dataset(tmp_path / name / "probes.nc") for name in found)
    assert one.identical(other)
    assert found["native"]["activity"] == found["board"]["activity"]
    assert found["native"]["link"] is None
    link = found["board"]["link"]
    assert isinstance(link, dict)
    assert (link["steps"], link["held"], link["damaged"]) == (300, 0, 0)


@pytest.mark.slow
def test_a_lost_board_leaves_the_robot_in_damping(tmp_path: Path, kept: Cache) -> None:
    folder = tmp_path / "run"
    with pytest.raises(BoardLostError, match="the robot went into damping, its last states are in"):
        reach(folder, 0.5, "board", LinkOptions(faults=("cut@300",)), kept)
    with np.load(folder / "last_states.npz") as states:
        time_s, arm_rad_s = states["time_s"], np.abs(states["qvel"][:, -5:]).max(axis=1)
    lost = np.searchsorted(time_s, 0.3)
    assert len(time_s) - lost >= 150
    assert arm_rad_s[-1] < 0.5 * arm_rad_s[:lost].max()
