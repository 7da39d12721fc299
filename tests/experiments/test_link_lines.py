"""Lines about the links of a run, to its board and to its robot."""

from spikeport.experiments.link_lines import link_line, robot_line


def test_a_line_sums_up_the_figures_of_the_boards_link() -> None:
    trips = {"median": 182.7, "p99": 5089.5, "worst": None}
    link = {
        "runs": "native",
        "real_time": True,
        "steps": 1000,
        "held": 3,
        "overruns": 12,
        "round_trip_us": trips,
    }
    assert link_line(link) == (
        "board (native, real time): round trip 183 us, p99 5,090, worst -; "
        "3 of 1,000 steps held, 12 began late"
    )
    assert link_line({"replays": "x.rec", "runs": "native"}) == "replayed: x.rec"


def test_a_line_sums_up_the_figures_of_the_robots_link() -> None:
    truth = {"name": "truth", "velocity_error_m_s": None, "place_deviation_m": 0.0}
    figures = {"states": 4000, "held": 3, "damaged": 0, "overruns": 12, "estimator": truth}
    assert robot_line(figures) == (
        "robot: 4,000 states, 3 held, 12 steps began late; estimator truth"
    )
    itself, trips = {"motion": "19d239d19b9d"}, {"median": 501.7, "p99": None, "worst": 1.0}
    ekf = {"name": "ekf", "velocity_error_m_s": [0.01, 0.02, 0.03], "place_error_m": 0.126}
    known = {"robot": itself, "round_trip_us": trips, "estimator": ekf}
    assert robot_line({**figures, **known}) == (
        "robot: 4,000 states, 3 held, 12 steps began late; round trip 502 us; motion 19d239d19b9d; "
        "estimator ekf, off by 0.010, 0.020, 0.030 m/s and 0.13 m"
    )
    alone = {"name": "ekf", "velocity_error_m_s": None, "place_deviation_m": 0.234}
    assert robot_line({**figures, "estimator": alone}).endswith(
        "estimator ekf, own estimate of its error 0.23 m"
    )
