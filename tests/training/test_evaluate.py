from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.training import evaluate as module
from spikeport.training import randomisation
from spikeport.training.environment import TrainingTask
from spikeport.training.evaluate import Tally, evaluate

CALM = TrainingTask(randomisation=randomisation.UNDISTURBED)
HIPS_BACK = 1.0 * np.isin(np.arange(19), [2, 7])


def robots(vx, wz, age_s, lifted_m=0.0, touched=False):
    """Return two robots asked for 0.5 m/s and 0.2 rad/s; their left foot is up, or comes down."""
    level = np.tile([vx, 0.0, 0.0], (2, 1))
    return SimpleNamespace(
        motion=SimpleNamespace(level_velocity=level, yaw_rate=np.full(2, wz)),
        commands=SimpleNamespace(value=np.tile([0.5, 0.0, 0.2], (2, 1)), age_s=np.full(2, age_s)),
        feet=SimpleNamespace(height_m=np.tile([lifted_m, 0.0], (2, 1))),
        gait=SimpleNamespace(touched_down=np.tile([touched, False], (2, 1))),
    )


def tallied(*steps, fallen=()):
    tally = Tally(2)
    for number, step in enumerate(steps):
        tally.add(step, np.array([number in fallen, False]))
    return tally.result()


def test_the_first_second_after_a_change_is_left_out():
    settled = [robots(0.4, 0.1, 1.5)] * 20
    result = tallied(*settled, robots(9.0, 9.0, 0.5))
    assert result.vx_error_m_s == pytest.approx(0.1)
    assert result.wz_error_rad_s == pytest.approx(0.1)


def test_speeds_are_averaged_over_a_fifth_of_a_second():
    swaying = [robots(0.5 + sway, 0.2, 2.0) for sway in (0.3, -0.3) * 20]
    result = tallied(*[robots(0.5, 0.2, 0.0)] * 10, *swaying)
    assert result.vx_error_m_s < 0.005


def test_a_robot_that_falls_again_counts_as_one_fall():
    result = tallied(*[robots(0.4, 0.2, 2.0)] * 3, fallen=(1, 2))
    assert (result.episodes, result.fallen) == (2, 1)


def test_steps_are_counted_and_their_clearance_is_the_highest_lift():
    swing = [robots(0.5, 0.2, 2.0, lifted_m=height) for height in (0.05, 0.11, 0.08)]
    result = tallied(*swing, robots(0.5, 0.2, 2.0, touched=True))
    assert result.clearance_m == pytest.approx(0.11)
    assert result.steps_per_s == pytest.approx(1 / 0.08)


def test_each_step_counts_with_its_own_highest_lift():
    down = robots(0.5, 0.2, 2.0, touched=True)
    high, low = (robots(0.5, 0.2, 2.0, lifted_m=height) for height in (0.11, 0.05))
    result = tallied(high, down, low, down)
    assert result.clearance_m == pytest.approx(0.08)  # the mean of 11 cm and 5 cm


def test_a_walk_without_a_step_has_no_clearance():
    assert tallied(robots(0.5, 0.2, 2.0)).clearance_m == 0


def test_robots_without_a_policy_fall(monkeypatch):
    monkeypatch.setattr(module, "EPISODE_STEPS", 100)
    result = evaluate(lambda x: np.tile(HIPS_BACK, (len(x), 1)), CALM, episodes=3)
    assert (result.episodes, result.fallen) == (3, 3)


def test_the_same_seed_gives_the_same_figures(monkeypatch):
    monkeypatch.setattr(module, "EPISODE_STEPS", 20)
    monkeypatch.setattr(module, "SETTLING_S", 0.1)
    policy = lambda x: 0.1 * x[:, :19]  # noqa: E731
    first, again, other = (
        evaluate(policy, TrainingTask(), episodes=2, seed=seed).vx_error_m_s for seed in (3, 3, 4)
    )
    assert first == again != other


def test_figures_do_not_depend_on_the_number_of_threads(monkeypatch):
    monkeypatch.setattr(module, "EPISODE_STEPS", 60)
    policy = lambda x: 0.1 * x[:, :19]  # noqa: E731
    one, three = (evaluate(policy, TrainingTask(), episodes=4, threads=n) for n in (1, 3))
    assert one == three


def test_errors_without_a_counted_step_are_infinite():
    assert tallied(robots(0.5, 0.2, 0.5)).vx_error_m_s == np.inf
