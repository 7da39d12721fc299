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
    "settings", [{"settings": {"network_seed": 7}}, {"varied": {"network_seed": (7,)}}]
)
def test_a_network_seed_that_is_set_stays(sweep_of, settings):
    (point,) = sweep_of(**{"varied": {}, "seeds": (3,), **settings}).points()
    assert (point.settings["network_seed"], point.place["seed"]) == (7, 3)


def test_a_points_name_is_a_files_name(sweep_of):
    (point,) = sweep_of(varied={"path": ("a/b,c.csv",), "tau_fwd": (0.002,)}).points()
    assert point.name == "path=a%2Fb%2Cc.csv,tau_fwd=0.002,seed=0"


def test_points_share_a_network_where_settings_of_the_run_alone_differ(sweep_of):
    def networks(**varied):
        points = sweep_of(varied=varied, seeds=(0, 1), settings={"network_seed": 5}).points()
        return len({point.network for point in points})

    assert networks(path=("paper", "line"), speed=(0.3, 0.5)) == 1
    assert networks(n_neurons=(2, 20), path=("paper", "line")) == 2
    assert networks(backend=("native", "nengo-loihi")) == 2


def test_points_with_a_network_seed_of_their_own_share_none(sweep_of):
    points = sweep_of(varied={"path": ("paper", "line")}, seeds=(0, 1)).points()
    assert len({point.network for point in points}) == 2
