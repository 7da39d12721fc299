"""Figures of episodes: of the exact policy, and of a made-up recording."""

import numpy as np
import pytest

from spikeport.experiments.evaluate.measures import MEASURES, SHORTEST_S, measure
from spikeport.experiments.evaluate.stage import EpisodeRecording, Stage
from spikeport.experiments.evaluate.walker import ExactWalker
from spikeport.experiments.policy.settings import load_policy
from spikeport.experiments.walk.legs import OBSERVATION_DT_S
from spikeport.robot.link.h1 import SPEED_LIMITS_RAD_S
from spikeport.robot.perturbation import NONE, Perturbation

DT_S = 0.005


@pytest.fixture(scope="module")
def walker():
    return ExactWalker(load_policy())


def test_the_exact_policys_figures_are_within_their_usual_bounds(walker):
    figures = measure(walker.walk(NONE, 6.0, 4))
    assert (figures["falls"], figures["fallen_at_s"]) == (0, None)
    assert set(MEASURES) < set(figures)
    assert figures["speed_error_m_s"] < 0.06
    assert figures["yaw_rate_error_rad_s"] < 0.1
    assert 0.05 < figures["clearance_m"] < 0.2
    assert 2 < figures["steps_per_s"] < 6
    assert figures["torque_use"] <= 1


def test_the_shortest_episode_that_is_accepted_has_figures(walker):
    figures = measure(walker.walk(NONE, SHORTEST_S + 0.001, 4))
    assert figures["speed_error_m_s"] < 0.2


def test_an_episode_with_an_early_fall_has_no_other_figures(walker):
    figures = measure(walker.walk(Perturbation(strength=0.2), 6.0, 4))
    assert figures["falls"] == 1
    assert figures["fallen_at_s"] < 4
    assert [figures[name] for name in MEASURES] == [None] * len(MEASURES)


class MadeUp:
    """A witness that returns a made-up recording."""

    def __init__(self, recording):
        self._recording = recording

    def recording(self):
        return self._recording


def gliding(terrain="flat"):
    """Return a stage and the gait of a robot on it.

    The robot glides at 0.5 m/s and lifts each foot by 8 cm for 0.4 s of every second.
    """
    stage = Stage(Perturbation(terrain=terrain), 6.0, 0, None, OBSERVATION_DT_S, DT_S)
    n = 1200
    time_s = DT_S * (1 + np.arange(n))
    qpos = np.tile(stage.plant.data.qpos, (n, 1))
    qpos[:, 3:7], qpos[:, 7:] = [1, 0, 0, 0], 0.1
    qvel = np.zeros((n, 25))
    qvel[:, 0], qvel[:, 6 + 3] = 0.5, 0.25 * SPEED_LIMITS_RAD_S[3]
    torque = np.zeros((n, 19))
    torque[:, 3] = 30.0
    feet = np.zeros((n, 2, 16))
    phase = (time_s[:, None] + [0, 0.5]) % 1
    up = phase < 0.4
    feet[:, :, [0, 1, 3, 4]] = [1.0, 0.5, 1.2, 0.5]
    floor_m = stage.plant.floor.height_m(feet[:, :, [0, 3]], feet[:, :, [1, 4]])
    feet[:, :, 2] = floor_m[..., 0] + 0.02 + 0.08 * up * np.sin(np.pi * phase / 0.4)
    # Toes are higher, so the heels count.
    feet[:, :, 5] = floor_m[..., 1] + feet[:, :, 2] - floor_m[..., 0] + 0.1
    # A foot bears most after the 50 ms that count as its impact.
    feet[:, :, 15] = np.where(up, 0.0, np.where(phase < 0.452, 500.0, 800.0))
    feet[:, :, 6] = 0.1  # the heels slide
    command = np.tile([0.6, 0.0, 0.0], (n, 1))
    return stage, EpisodeRecording(time_s, qpos, qvel, torque, feet.reshape(n, -1), command)


def figures_of(stage, gait):
    stage.witness = MadeUp(gait)
    return measure(stage)


@pytest.mark.parametrize("terrain", ["flat", "slope:6"])
def test_a_known_gait_has_the_expected_figures(terrain):
    stage, gait = gliding(terrain)
    figures = figures_of(stage, gait)
    weight_n = stage.plant.model.body_mass.sum() * 9.81
    assert figures["speed_error_m_s"] == pytest.approx(0.1)
    assert figures["yaw_rate_error_rad_s"] == pytest.approx(0)
    assert figures["torque_use"] == pytest.approx(0.1)
    assert figures["speed_use"] == pytest.approx(0.25)
    assert figures["clearance_m"] == pytest.approx(0.08, abs=1e-3)
    assert figures["double_support"] == pytest.approx(0.2, abs=0.01)
    assert figures["steps_per_s"] == pytest.approx(2, abs=0.1)
    assert figures["slip_m_s"] == pytest.approx(0.1, abs=1e-6)
    assert figures["impact_bw"] == pytest.approx(500 / weight_n)
    assert figures["cost_of_transport"] == pytest.approx(30 * 3.5 / (weight_n * 0.5))


def test_the_time_in_which_a_robot_is_asked_to_stand_does_not_count_as_gait():
    stage, gait = gliding()
    gait.command[:200] = 0.0
    gait.feet[:200] = gait.feet[89]  # at 0.45 s, both feet are down
    figures = figures_of(stage, gait)
    # Over all 6 s, the share of double support would be (1 + 5 x 0.2) / 6.
    assert figures["double_support"] == pytest.approx(0.2, abs=0.01)


def test_touch_downs_of_a_robot_that_is_asked_to_stand_do_not_count():
    stage, gait = gliding()
    gait.command[:200] = 0.0  # it steps all the same, twice in this second
    assert figures_of(stage, gait)["steps_per_s"] == pytest.approx(2, abs=0.01)  # not 12 / 5


@pytest.mark.parametrize(("n_rows", "more"), [(1, 0), (9, 0), (10, 5)])
def test_a_foot_that_leaves_the_floor_for_less_than_50_ms_takes_no_step(n_rows, more):
    stage, gait = gliding()
    begun = 120 + 200 * np.arange(5)
    for row in begun:  # at 0.6 s of every second, the left foot is down
        gait.feet.reshape(-1, 2, 16)[row : row + n_rows, 0, 15] = 0.0
    before, after = figures_of(*gliding()), figures_of(stage, gait)
    assert after["steps_per_s"] == pytest.approx(before["steps_per_s"] + more / 6)
    unchanged = [after[name] == before[name] for name in ("clearance_m", "impact_bw")]
    assert unchanged == [not more] * 2


@pytest.mark.parametrize(("n_rows", "steps"), [(9, 12), (10, 13)])
def test_the_first_contact_of_a_foot_that_a_reset_left_above_the_floor_is_no_step(n_rows, steps):
    stage, gait = gliding()
    bears = gait.feet.reshape(-1, 2, 16)[:, 1, 15]  # the right foot, down for the first 0.5 s
    bears[:n_rows], bears[n_rows] = 0.0, 1e5
    figures = figures_of(stage, gait)
    assert figures["steps_per_s"] == pytest.approx(steps / 6)
    assert (figures["impact_bw"] < 1) == (steps == 12)


def test_a_heel_that_lies_along_the_foot_is_as_high_as_its_lower_end():
    stage, gait = gliding()
    heel, toe = (stage.plant.model.geom(f"left_{part}") for part in ("heel", "toe"))
    heel.size[:], heel.quat[:] = [0.02, 0.03, 0.0], [np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0]
    ahead_m, _, up_m = toe.pos - heel.pos
    toes_up = np.arctan2(0.1, 0.2) - np.arctan2(up_m, ahead_m)  # toes are 0.2 m ahead, 0.1 m higher
    expected = 0.08 - 0.03 * np.sin(toes_up) / 2  # the right foot's heel is a sphere
    assert figures_of(stage, gait)["clearance_m"] == pytest.approx(expected, abs=2e-3)


def test_the_last_second_before_a_fall_does_not_count():
    stage, gait = gliding()
    stage.legs.fallen_at_s = 6.0
    limit = SPEED_LIMITS_RAD_S[5]
    gait.qvel[998, 6 + 5], gait.qvel[999:, 6 + 5] = 0.5 * limit, 0.9 * limit  # 4.995 s, then 5 s
    figures = figures_of(stage, gait)
    assert (figures["falls"], figures["fallen_at_s"]) == (1, 6.0)
    assert figures["speed_use"] == pytest.approx(0.5)


def test_work_and_way_count_only_while_the_robot_is_commanded_ahead():
    stage, gait = gliding()
    without = figures_of(stage, gait)["cost_of_transport"]
    gait.command[:300] = 0.0
    gait.torque_nm[:300] *= 10
    assert figures_of(stage, gait)["cost_of_transport"] == pytest.approx(without)
    gait.command[100:] = 0.0
    assert figures_of(stage, gait)["cost_of_transport"] is None


def test_torques_go_with_the_speed_of_the_step_that_they_acted_in():
    stage, gait = gliding()
    even = np.arange(len(gait.time_s)) % 2 == 0
    # Every other step, torque acts while a joint comes to rest.
    gait.qvel[even, 6 + 3], gait.torque_nm[~even, 3] = 0.0, 0.0
    before, after = figures_of(*gliding()), figures_of(stage, gait)
    assert after["cost_of_transport"] == pytest.approx(before["cost_of_transport"] / 4, rel=0.01)


def test_a_foot_that_comes_to_rest_under_its_load_does_not_slip():
    stage, gait = gliding()
    n, even = len(gait.time_s), np.arange(len(gait.time_s)) % 2 == 0
    # Every other step, the feet rest under their load; in the others they move without one.
    gait.feet.reshape(n, 2, 16)[even, :, 6:12] = 0.0
    gait.feet.reshape(n, 2, 16)[~even, :, 13:16] = 0.0
    assert figures_of(*gliding())["slip_m_s"] > 0
    assert figures_of(stage, gait)["slip_m_s"] == 0


def test_a_joint_that_brakes_returns_no_energy():
    stage, gait = gliding()
    without = figures_of(stage, gait)["cost_of_transport"]
    gait.torque_nm[:, 4], gait.qvel[:, 6 + 4] = -20.0, 1.0
    assert figures_of(stage, gait)["cost_of_transport"] == pytest.approx(without)


@pytest.mark.parametrize(("n_steps", "use"), [(10, 0.1), (14, 0.2)])
def test_a_peak_of_torque_counts_from_a_hundredth_of_the_time_on(n_steps, use):
    stage, gait = gliding()
    gait.torque_nm[:n_steps] *= 2  # a hundredth of the time is 12 steps
    assert figures_of(stage, gait)["torque_use"] == pytest.approx(use)


@pytest.mark.parametrize(("stop", "inwards"), [(0, 1), (1, -1)])
@pytest.mark.parametrize("margin_rad", [0.03, -0.02])
def test_a_joints_margin_is_its_distance_from_either_stop_and_negative_beyond(
    stop, inwards, margin_rad
):
    stage, gait = gliding()
    # Joint 0 of the model is the free one of the pelvis.
    gait.qpos[600, 7 + 5] = stage.plant.model.jnt_range[1 + 5, stop] + inwards * margin_rad
    assert figures_of(stage, gait)["joint_margin_rad"] == pytest.approx(margin_rad)


def test_a_joint_that_moves_backwards_uses_as_much_of_its_speed():
    stage, gait = gliding()
    gait.qvel[:, 6 + 5] = -0.4 * SPEED_LIMITS_RAD_S[5]
    assert figures_of(stage, gait)["speed_use"] == pytest.approx(0.4)
