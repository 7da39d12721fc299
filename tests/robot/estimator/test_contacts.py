import numpy as np

from spikeport.robot.estimator.contacts import ContactDetector, ContactLimits

LIMITS = ContactLimits(height_m=0.01, support_n=30.0, settling_s=0.02)
WEIGHT, NONE = np.full(4, 200.0), np.zeros(4)
LEFT_DOWN = np.array([0.0, 0.005, 0.1, 0.1])


def test_a_point_stands_once_it_was_low_and_loaded_for_a_while():
    detector = ContactDetector(4, LIMITS)
    times_s = (0.0, 0.005, 0.019, 0.021)
    found = [detector.update(t, LEFT_DOWN, WEIGHT).tolist() for t in times_s]
    assert found[:3] == 3 * [4 * [False]]
    assert found[3] == [True, True, False, False]


def test_heights_are_compared_with_the_lowest_point():
    one, other = ContactDetector(4, LIMITS), ContactDetector(4, LIMITS)
    for time_s in (0.0, 0.03):
        found = one.update(time_s, LEFT_DOWN - 0.9, WEIGHT), other.update(time_s, LEFT_DOWN, WEIGHT)
    assert found[0].tolist() == found[1].tolist() == [True, True, False, False]


def test_an_unloaded_point_stops_standing_at_once_and_must_settle_again():
    detector = ContactDetector(4, LIMITS)
    detector.update(0.0, LEFT_DOWN, WEIGHT)
    assert detector.update(0.03, LEFT_DOWN, WEIGHT).any()
    assert not detector.update(0.035, LEFT_DOWN, NONE).any()
    assert not detector.update(0.04, LEFT_DOWN, WEIGHT).any()
    assert not detector.update(0.055, LEFT_DOWN, WEIGHT).any()
    assert detector.update(0.061, LEFT_DOWN, WEIGHT).any()


def test_settling_takes_as_many_steps_at_any_time():
    # Sums of steps, as the time of a robot: for many beginnings, 4 steps are a bit less than 20 ms.
    times_s = np.cumsum(np.full(4000, 0.005))
    assert (times_s[4:] - times_s[:-4] < LIMITS.settling_s).any()
    for begin in range(0, 4000 - 5, 100):
        detector = ContactDetector(4, LIMITS)
        stood = [detector.update(t, LEFT_DOWN, WEIGHT).any() for t in times_s[begin : begin + 5]]
        assert stood == [False, False, False, False, True]


def test_the_lowest_points_of_a_robot_in_the_air_do_not_stand():
    detector = ContactDetector(4, LIMITS)
    assert not any(detector.update(t, np.zeros(4), NONE).any() for t in np.arange(0, 1, 0.005))
