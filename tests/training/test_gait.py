import numpy as np

from spikeport.training.gait import Gait


def walked(*contacts):
    gait = Gait(1)
    for left, right in contacts:
        gait.update(np.array([[left, right]], bool))
    return gait


def test_the_clocks_follow_a_step_with_the_left_foot():
    gait = walked((1, 1), (0, 1), (0, 1), (0, 1))
    np.testing.assert_allclose(gait.air_s, [[0.06, 0]])
    np.testing.assert_allclose(gait.contact_s, [[0, 0.08]])
    np.testing.assert_allclose(gait.since_lift_s, [[0.04, 0.08]])
    assert not gait.touched_down.any()


def test_a_touchdown_keeps_the_time_in_the_air():
    gait = walked((1, 1), (0, 1), (0, 1), (1, 1))
    assert gait.touched_down.tolist() == [[True, False]]
    np.testing.assert_allclose(gait.last_air_s, [[0.04, 0]])
    np.testing.assert_allclose(gait.air_s, 0)


def test_reset_puts_both_feet_down():
    gait = walked((1, 1), (0, 1), (0, 1))
    gait.reset(np.array([True]))
    gait.update(np.ones((1, 2), bool))
    assert not gait.touched_down.any()
    np.testing.assert_allclose(gait.since_lift_s, 0.02)


def test_a_foot_counts_as_on_the_floor_until_it_first_touches_it():
    gait = walked((0, 1), (0, 1), (1, 1))
    assert not gait.touched_down.any()
    np.testing.assert_allclose(gait.contact_s, 0.06)
    gait.update(np.array([[False, True]]))
    assert gait.lifted.tolist() == [[True, False]]
    gait.reset(np.array([True]))
    gait.update(np.array([[False, True]]))
    assert gait.contact.all()


def test_the_time_on_both_feet_lasts_until_the_step_in_which_one_is_lifted():
    gait = walked((1, 1), (0, 1), (0, 1), (1, 1), (1, 1))
    np.testing.assert_allclose(gait.both_s, [0.04])
    gait.update(np.array([[True, False]]))
    assert gait.lifted.tolist() == [[False, True]]
    np.testing.assert_allclose(gait.both_s, [0.04])
    gait.update(np.array([[True, False]]))
    assert not gait.lifted.any()
    np.testing.assert_allclose(gait.both_s, [0.0])
