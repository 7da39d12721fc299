import numpy as np
import pytest

from spikeport.errors import DivergedError
from spikeport.robot.description import JOINTS
from spikeport.robot.plant import Plant

CURE = "; command smaller torques or gains (Plant.history() holds the last states)"


@pytest.fixture
def plant():
    return Plant(anchored=True)


def test_a_joint_angle_that_is_nan_is_named(plant):
    plant.step()
    plant.data.joint("right_elbow").qpos = np.nan
    with pytest.raises(DivergedError) as error:
        plant.step()
    assert str(error.value) == (
        "the simulation diverged at 0.010 s: angle of right_elbow is nan, allowed -1.75 to 3.11 rad"
        + CURE
    )


def test_a_joint_out_of_its_range_is_named(plant):
    plant.data.joint("left_knee").qpos = 2.6
    with pytest.raises(DivergedError) as error:
        plant.step()
    assert str(error.value) == (
        "the simulation diverged at 0.005 s: angle of left_knee is 2.6, allowed -0.76 to 2.55 rad"
        + CURE
    )


def test_an_absurd_velocity_is_named(plant):
    plant.data.qvel[:3] = [0, 0, 1000]
    with pytest.raises(DivergedError, match=r"base velocity z is \d+, allowed -50 to 50 m/s; "):
        plant.step()


def test_mujoco_does_not_hide_a_divergence_by_starting_over(plant, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # mujoco logs its warnings to the working folder
    plant.step()
    plant.data.qfrc_applied[-1] = 1e15  # on the right elbow
    with pytest.raises(DivergedError, match=r"diverged at 0.010 s: base position x is "):
        plant.step()


def test_the_history_holds_the_state_that_diverged(plant):
    plant.data.joint("left_knee").qpos = 2.6
    with pytest.raises(DivergedError):
        plant.step()
    history = plant.history()
    assert history["time_s"].tolist() == [0, 0.005]
    assert history["qpos"][-1, 7 + JOINTS.index("left_knee")] > 2.55


def test_full_torque_against_the_stops_is_not_a_divergence(plant):
    rng = np.random.RandomState(1)
    most = 0.0
    for step in range(1000):
        if step % 60 == 0:
            plant.torque(JOINTS, rng.choice([-1e3, 1e3], 19))
        plant.step()
        low, high = plant.model.jnt_range[1:].T
        most = max(most, (plant.state.q - high).max(), (low - plant.state.q).max())
    assert 0.05 < most < 0.5
