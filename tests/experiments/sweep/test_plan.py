"""Points of a sweep: all combinations, seed by seed."""

from importlib.metadata import version

import pytest

from spikeport.cache import COMPUTING
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import LONGEST_NAME, computing_versions
from tests.helpers.sweeps import VARIED, finish


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


def test_the_name_of_a_point_is_valid_as_the_name_of_a_file(sweep_of):
    (point,) = sweep_of(varied={"path": ("a/b,c.csv",), "tau_fwd": (0.002,)}).points()
    assert point.name == "path=a%2Fb%2Cc.csv,tau_fwd=0.002,seed=0"


def test_the_name_of_a_file_in_a_setting_need_not_be_utf_8(sweep_of):
    (point,) = sweep_of(varied={"policy": ("p\udcff.npz",)}).points()
    assert point.name == "policy=p%FF.npz,seed=0"


@pytest.mark.parametrize("length", [200, 230, 240, 300])
def test_points_with_long_values_are_kept_under_names_that_file_systems_accept(
    sweep_of, tmp_path, length
):
    files = tuple(f"{'a' * length}{n}.csv" for n in range(2))
    sweep, folder = sweep_of(settings={}, varied={"path": files}), SweepFolder(tmp_path)
    for number, point in enumerate(sweep.points()):
        assert not folder.holds(point)
        finish(folder, point, b"series", number=number)
    assert [folder.read(point)["metrics"]["number"] for point in sweep.points()] == [0, 1]


def test_a_name_of_the_greatest_length_allowed_is_not_shortened(sweep_of):
    """Points of earlier sweeps are kept under such names."""
    (point,) = sweep_of(varied={"path": ("a" * 223,)}).points()
    assert point.name == f"path={'a' * 223},seed=0"
    assert len(point.name) == LONGEST_NAME


def test_a_plan_has_the_versions_of_all_packages_that_figures_depend_on():
    versions = computing_versions()
    assert versions["scikit-learn"] == version("scikit-learn")
    assert versions["nengo-spa"] == version("nengo-spa")
    assert versions.keys() > set(COMPUTING)


def test_points_that_differ_only_in_settings_of_the_run_share_a_network(sweep_of):
    def networks(**varied):
        points = sweep_of(varied=varied, seeds=(0, 1), settings={"network_seed": 5}).points()
        return len({point.network for point in points})

    assert networks(path=("paper", "line"), speed=(0.3, 0.5)) == 1
    assert networks(n_neurons=(2, 20), path=("paper", "line")) == 2
    assert networks(backend=("native", "nengo-loihi")) == 2


def test_points_without_a_fixed_network_seed_share_a_network_per_seed(sweep_of):
    points = sweep_of(varied={"path": ("paper", "line")}, seeds=(0, 1)).points()
    assert len({point.network for point in points}) == 2
