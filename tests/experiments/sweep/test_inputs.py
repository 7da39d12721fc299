"""Files that settings name, which must not change after a plan began."""

import shutil
from importlib.metadata import version
from pathlib import Path

import pytest

from spikeport.cache import own_version
from spikeport.errors import UsageError
from spikeport.experiments.digests import digest
from spikeport.experiments.evaluate.plan import EvaluationSweep
from spikeport.experiments.sweep.folder import PointFiles
from spikeport.experiments.sweep.inputs import Unchanged, check, with_inputs
from spikeport.experiments.switch.schedule import SHIPPED
from spikeport.hardware_models.chip import BUILT_IN
from spikeport.networks import walking_policy
from tests.helpers.sweeps import write_path


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Return the working folder, which holds the file of a path."""
    monkeypatch.chdir(tmp_path)
    write_path(tmp_path / "path.csv", 0.3)
    return tmp_path


def test_files_of_settings_values_and_the_chip_are_in_the_plan(sweep_of, here):
    shutil.copy(BUILT_IN / "loihi.toml", "chip.toml")
    shutil.copy(walking_policy.SHIPPED, "policy.npz")
    Path("calibration.npz").write_bytes(b"decoders")
    Path("env.yaml").write_text("robot: h1")
    sweep = sweep_of(
        chip="chip.toml",
        settings={"policy": "policy.npz", "description": "env.yaml"},
        varied={"path": ("line", "path.csv"), "calibrated": (True, "auto", "calibration.npz")},
    )
    files = ["calibration.npz", "chip.toml", "env.yaml", "path.csv", "policy.npz"]
    assert with_inputs(sweep).files == {name: digest(Path(name)) for name in files}


def test_shipped_names_are_no_input_files_even_if_files_have_these_names(sweep_of, here):
    for name in ("line", "loop", "spiking", "mlp", "auto", "loihi"):
        Path(name).touch()
    sweep = sweep_of(settings={}, varied={"path": ("line", "loop"), "policy": ("spiking", "mlp")})
    assert with_inputs(sweep).files == {}
    assert with_inputs(sweep_of(experiment="switch", settings={}, varied={})).files == {}


def test_paths_that_a_schedule_names_are_in_the_plan(sweep_of, here):
    written = SHIPPED["switch"].read_text()
    asked = 'path = "line"\nspeed_m_s = 0.5'
    assert asked in written
    Path("own.toml").write_text(written.replace(asked, 'path = "path.csv"'))
    asked = {"experiment": "switch", "seconds": 60.0, "varied": {}}
    sweep = with_inputs(sweep_of(**asked, settings={"schedule": "own.toml"}))
    assert list(sweep.files) == ["own.toml", "path.csv"]


def test_a_calibration_of_the_arm_is_in_the_plan(sweep_of, here):
    Path("arm.npz").write_bytes(b"decoders")
    asked = {"experiment": "reach", "settings": {}, "varied": {"calibrated": (False, "arm.npz")}}
    assert list(with_inputs(sweep_of(**asked)).files) == ["arm.npz"]


def test_files_of_an_evaluation_are_in_its_plan(here):
    shutil.copy(walking_policy.SHIPPED, "policy.npz")
    settings = {"policy": "policy.npz"}
    asked = ("walk", "analytic", "loihi", None, 4.0, settings, {}, (0, 1))
    plan = with_inputs(EvaluationSweep(*asked, rows=({}, {"push": 0.5})))
    assert list(plan.files) == ["policy.npz"]
    assert plan.points()[0].sweep is plan


def test_menageries_robot_is_in_the_plan_where_a_point_has_it(here, monkeypatch):
    monkeypatch.setenv("MENAGERIE_ROOT", str(here))
    model = here / "unitree_h1" / "h1.xml"
    model.parent.mkdir()
    model.write_text("<mujoco/>")
    asked = ("walk", "analytic", "loihi", None, 4.0, {}, {}, (0, 1))
    plan = with_inputs(EvaluationSweep(*asked, rows=({}, {"robot_model": "menagerie"})))
    assert plan.files == {str(model): digest(model)}
    assert with_inputs(EvaluationSweep(*asked, rows=({}, {"push": 0.5}))).files == {}


def test_a_point_whose_file_changed_is_refused_and_others_are_not(sweep_of, here):
    write_path(Path("b.csv"), 0.3)
    plan = with_inputs(sweep_of(settings={}, varied={"path": ("path.csv", "b.csv")}))
    a, b = plan.points()
    before = digest(Path("b.csv"))
    write_path(Path("b.csv"), 0.2)
    check(a)
    with pytest.raises(UsageError) as caught:
        check(b)
    assert str(caught.value) == (
        f"b.csv: changed since the sweep began (digest {before} then, {digest(Path('b.csv'))} "
        "now); put it back and give the same command again, or choose another --out"
    )
    Path("b.csv").unlink()
    with pytest.raises(UsageError, match=r"b\.csv: no such file"):
        check(b)


@pytest.mark.parametrize("other", [{"spikeport": "0.1"}, {"versions": {"numpy": "0.1"}}])
def test_a_worker_with_other_versions_than_the_plan_is_refused(sweep_of, other):
    (point,) = sweep_of(settings={}, varied={}, **other).points()
    name = next(iter(other.get("versions", other)))
    here = own_version() if name == "spikeport" else version(name)
    with pytest.raises(UsageError) as caught:
        Unchanged(lambda *_: PointFiles({}, None))(point, "")
    assert str(caught.value) == (
        f"{name} is {here} in the worker, but 0.1 where the sweep began; cure: install "
        "the same version, or choose another --out if you changed it"
    )


def test_a_point_whose_file_changes_while_it_runs_is_refused(sweep_of, here):
    plan = with_inputs(sweep_of(settings={"path": "path.csv"}, varied={}))
    (point,) = plan.points()
    assert Unchanged(lambda *_: PointFiles({}, None))(point, "") == PointFiles({}, None)

    def changing(*_):
        write_path(Path("path.csv"), 0.2)
        return PointFiles({}, None)

    with pytest.raises(UsageError, match=r"path\.csv: changed since the sweep began"):
        Unchanged(changing)(point, "")
