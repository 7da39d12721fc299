"""The time series of a switching run."""

from types import SimpleNamespace

import numpy as np

from spikeport.experiments.switch.recording import dataset
from spikeport.experiments.walk.recording import dataset as walk_dataset
from tests.helpers.walk_runs import walked


def test_a_switch_has_the_series_of_a_walk_and_those_of_the_hand():
    run = walked(0.05)
    n = len(run.recording.time_s)
    rows = np.arange(3.0 * n).reshape(n, 3)
    switched = SimpleNamespace(
        recording=run.recording,
        arm=SimpleNamespace(torque=np.zeros((n, 4)), hand=rows, target=rows + 1),
        local_m=rows + 2,
        hands_m=rows + 3,
        gates=np.zeros((5 * n, 2)),
        spikes={},
    )
    found, walk = dataset(switched), walk_dataset(run)
    assert {"observation", "command", "height", "on_floor"} <= {*walk.data_vars}
    for name, values in walk.data_vars.items():
        assert found[name].identical(values)
    assert found.hand_in_task.values.tolist() == (rows + 2).tolist()
    assert found.hand_in_world.sel(axis="z").values.tolist() == (rows + 3)[:, 2].tolist()
