"""The last states of a simulation."""

import numpy as np

from spikeport.robot.history import History
from spikeport.robot.plant import Plant


def test_the_last_states_are_kept_oldest_first():
    plant = Plant()
    history = History(plant.model, length=3)
    assert history.arrays()["time_s"].shape == (0,)
    for step in range(5):
        plant.data.time = step
        plant.data.qpos[0] = 10 * step
        plant.data.ctrl[2] = 100 * step
        recorded = history.record(plant.data)
        assert np.array_equal(recorded, np.append(plant.data.qpos, plant.data.qvel))
    kept = history.arrays()
    assert kept["time_s"].tolist() == [2, 3, 4]
    assert kept["qpos"][:, 0].tolist() == [20, 30, 40]
    assert kept["ctrl"][:, 2].tolist() == [200, 300, 400]
    assert [kept[name].shape for name in ("qpos", "qvel", "ctrl")] == [(3, 26), (3, 25), (3, 19)]


def test_a_cleared_history_is_empty():
    plant = Plant()
    history = History(plant.model, length=3)
    history.record(plant.data)
    history.clear()
    assert len(history.arrays()["qpos"]) == 0
