import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.experiments.policy.observations import normal_observations, read_observations
from spikeport.networks.loading.mlp import Mlp, Moments
from spikeport.networks.policy_values import Layer

CURE = "; write it with: numpy.savez(file, observations=array)"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "seen.npz"


@pytest.mark.parametrize(
    "arrays",
    [
        {"x": np.ones((4, 3))},
        {"observations": np.ones((4, 3), dtype=np.float32), "other": np.ones(2)},
    ],
)
def test_the_array_named_observations_or_the_only_array_is_read(path, arrays):
    np.savez(path, **arrays)
    found = read_observations(path, 3)
    np.testing.assert_array_equal(found.values, np.ones((4, 3)))
    assert found.origin == f"4 of {path}"


OTHERS = "NaN, infinity or values that are not real numbers"


@pytest.mark.parametrize(
    ("arrays", "complaint"),
    [
        ({"x": np.ones((4, 2))}, "expected an array (m, 3), found shape (4, 2)"),
        ({"x": np.ones((0, 3))}, "expected an array (m, 3), found shape (0, 3)"),
        ({"x": np.full((4, 3), np.nan)}, "expected finite numbers, found " + OTHERS),
        ({"x": np.full((4, 3), "a")}, "expected finite numbers, found " + OTHERS),
        ({"x": np.ones(1), "y": np.ones(1)}, "expected an array 'observations', found x, y"),
        ({}, "expected an array 'observations', found no array"),
    ],
)
def test_other_arrays_are_refused(path, arrays, complaint):
    np.savez(path, **arrays)
    with pytest.raises(UsageError) as error:
        read_observations(path, 3)
    assert str(error.value) == f"observations '{path}': {complaint}{CURE}"


def test_a_text_file_is_refused(path):
    path.write_text("1 2 3")
    with pytest.raises(UsageError) as error:
        read_observations(path, 3)
    complaint = "expected a whole zip archive, found one without a list of members"
    assert str(error.value) == f"observations '{path}': {complaint}{CURE}"


def test_a_single_array_is_refused_and_read_after_the_cure(tmp_path):
    single = tmp_path / "seen.npy"
    np.save(single, np.ones((4, 3)))
    with pytest.raises(UsageError) as error:
        read_observations(single, 3)
    complaint = "expected an archive of arrays (.npz), found a single array (.npy)"
    assert str(error.value) == f"observations '{single}': {complaint}{CURE}"
    archive = tmp_path / "seen.npz"
    np.savez(archive, observations=np.load(single))
    np.testing.assert_array_equal(read_observations(archive, 3).values, np.ones((4, 3)))


def perceptron(trained_on=None):
    layers = Layer(np.ones((2, 4)), np.zeros(2)), Layer(np.ones((1, 2)), np.zeros(1))
    return Mlp(layers, "elu", trained_on)


def test_normal_values_are_the_same_every_time():
    found = normal_observations(perceptron())
    assert found.origin == "1,000 standard normal ones, without a file of observations"
    np.testing.assert_array_equal(found.values, normal_observations(perceptron()).values)
    assert found.values.std() == pytest.approx(1, abs=0.05)


def test_normal_values_have_the_moments_a_policy_was_trained_on():
    moments = Moments(np.array([0.0, 5.0, -3.0, 100.0]), np.array([1.0, 0.0, 10.0, 0.1]))
    found = normal_observations(perceptron(moments))
    assert found.origin == ("1,000 normal ones, with mean and deviation of its normalisation")
    off = np.abs(found.values.mean(axis=0) - moments.mean)
    assert (off <= 4 * moments.std / np.sqrt(1000)).all()
    np.testing.assert_allclose(found.values.std(axis=0), moments.std, rtol=0.1)
