import numpy as np
import pytest

from spikeport.networks.region import PEAK_PERCENTILE, ArmRegion, Box

BOX = Box(np.array([1.0, -2.0]), np.array([0.5, 4.0]))


@pytest.fixture(scope="module")
def recording():
    rng = np.random.RandomState(3)
    sizes = {"q": 4, "dq": 4, "x": 3, "error": 3}
    return {name: rng.normal(1.0, 2.0, (500, n)) for name, n in sizes.items()}


def test_the_box_is_mapped_onto_plus_minus_one():
    corners = np.array([[0.5, -6.0], [1.0, -2.0], [1.5, 2.0]])
    assert BOX.normalise(corners) == pytest.approx(np.array([[-1, -1], [0, 0], [1, 1]]))


def test_restore_inverts_normalise_inside_the_box():
    values = BOX.centre + np.random.RandomState(0).uniform(-1, 1, (50, 2)) * BOX.half
    assert BOX.restore(BOX.normalise(values)) == pytest.approx(values, abs=1e-12)


def test_values_outside_are_clipped_dimension_by_dimension():
    assert BOX.normalise(np.array([9.0, 0.0])).tolist() == [1.0, 0.5]
    assert BOX.restore(BOX.normalise(np.array([9.0, -9.0]))).tolist() == [1.5, -6.0]


def test_a_box_around_samples_is_wider_by_the_margin():
    box = Box.around(np.array([[0.0, 5.0], [2.0, 1.0], [1.0, 2.0]]), margin=0.5)
    assert box.centre.tolist() == [1.0, 3.0]
    assert box.half.tolist() == [1.5, 3.0]


def test_a_box_is_widened_for_points_beyond_it_alone():
    assert BOX.holding(np.array([[0.5, -6.0], [1.5, 2.0]])) is BOX
    wider = BOX.holding(np.array([[1.0, 4.0], [0.8, -3.0]]))
    assert wider.normalise(np.array([[0.5, -6.0], [1.5, 4.0]])).tolist() == [[-1, -1], [1, 1]]


def test_a_region_holds_targets_and_their_errors(recording):
    region = ArmRegion.from_recording(**recording, seed=0)
    far = region.x.centre + 3 * region.x.half * [1, 0, 0]
    wider = region.holding(far[np.newaxis])
    assert wider.x.clip(far) == pytest.approx(far)
    assert (wider.error.half >= wider.x.half).all()
    assert wider.q is region.q
    assert wider.q_samples is region.q_samples


def test_a_symmetric_box_leaves_out_the_peaks():
    samples = np.arange(-1000.0, 1001.0)[:, np.newaxis]
    box = Box.symmetric(samples, margin=0.0)
    assert box.centre.tolist() == [0.0]
    assert box.half == pytest.approx(10 * PEAK_PERCENTILE, abs=1.0)


def test_the_samples_lie_in_the_box_of_joint_angles(recording):
    region = ArmRegion.from_recording(**recording, seed=0)
    assert region.q_samples.shape == (10_000, 4)
    assert (np.abs((region.q_samples - region.q.centre) / region.q.half) <= 1 + 1e-12).all()


def test_the_boxes_are_those_of_the_recording(recording):
    region = ArmRegion.from_recording(**recording, seed=0)
    for name, wanted in {
        "q": Box.around(recording["q"]),
        "x": Box.around(recording["x"]),
        "dq": Box.symmetric(recording["dq"]),
        "error": Box.symmetric(recording["error"]).at_least(Box.around(recording["x"]).half),
    }.items():
        assert np.array_equal(getattr(region, name).centre, wanted.centre)
        assert np.array_equal(getattr(region, name).half, wanted.half)


def test_the_samples_lie_beside_the_recorded_path_too(recording):
    recording = {**recording, "q": np.linspace([0, 0, 0, 0], [1, 1, 1, 1], 200)}
    samples = ArmRegion.from_recording(**recording, seed=0).q_samples
    off_the_path = np.abs(samples - samples.mean(axis=1, keepdims=True)).max(axis=1)
    assert np.median(off_the_path) > 0.05


def test_the_samples_follow_from_the_seed(recording):
    first = ArmRegion.from_recording(**recording, seed=0).q_samples
    assert np.array_equal(first, ArmRegion.from_recording(**recording, seed=0).q_samples)
    assert not np.array_equal(first, ArmRegion.from_recording(**recording, seed=1).q_samples)


def test_the_number_of_samples_is_set_by_the_caller(recording):
    assert ArmRegion.from_recording(**recording, seed=0, n_samples=7).q_samples.shape == (7, 4)


def test_the_box_of_errors_is_no_narrower_than_that_of_positions(recording):
    recording = {**recording, "error": recording["error"] * [0.01, 1.0, 100.0]}
    region = ArmRegion.from_recording(**recording, seed=0)
    assert (region.error.half >= region.x.half).all()
    assert region.error.half[0] == region.x.half[0]
    assert region.error.half[2] > 10 * region.x.half[2]
    assert region.error.centre.tolist() == [0.0, 0.0, 0.0]


def test_clip_moves_points_outside_a_box_to_its_nearest_point():
    assert BOX.clip(np.array([[1.2, 0.0], [9.0, 0.0]])) == pytest.approx(
        np.array([[1.2, 0.0], [1.5, 0.0]])
    )
