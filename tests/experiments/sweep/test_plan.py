"""Points of a sweep: all combinations, seed by seed."""

import pytest

from tests.helpers.sweeps import VARIED


def test_the_points_are_all_combinations_seed_by_seed(sweep_of):
    points = sweep_of(varied=VARIED, seeds=(3, 4)).points()
    assert [tuple(point.place.values()) for point in points] == [
        (n, backend, seed) for seed in (3, 4) for n in (2, 20) for backend in VARIED["backend"]
    ]


def test_a_point_has_its_own_settings_and_the_sweeps(sweep_of):
    point = sweep_of(varied=VARIED, seeds=(3,)).points()[0]
    assert point.settings == {"network_seed": 3, "path": "paper", "n_neurons": 2}
    options = point.options
    assert (options.seconds, options.seed) == (2.0, 3)
    assert (options.backend, options.chip, options.pipeline) == ("reference", "loihi", "compact")


@pytest.mark.parametrize(
    "given", [{"settings": {"network_seed": 7}}, {"varied": {"network_seed": (7,)}}]
)
def test_a_network_seed_that_is_given_stays(sweep_of, given):
    (point,) = sweep_of(**{"varied": {}, "seeds": (3,), **given}).points()
    assert (point.settings["network_seed"], point.place["seed"]) == (7, 3)


def test_a_points_name_is_a_files_name(sweep_of):
    (point,) = sweep_of(varied={"path": ("a/b,c.csv",), "tau_fwd": (0.002,)}).points()
    assert point.name == "path=a%2Fb%2Cc.csv,tau_fwd=0.002,seed=0"
