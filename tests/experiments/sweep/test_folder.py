"""The folder that a sweep leaves, and the folders it refuses."""

import json
from importlib.metadata import version

import pytest

from spikeport.atomic import locked
from spikeport.cache import own_version
from spikeport.errors import UsageError
from spikeport.experiments.sweep.folder import PointFiles, SweepFolder, opened
from spikeport.experiments.sweep.table import table
from tests.helpers.sweeps import finish, result


def begin(path, sweep):
    """Open a folder, and close it."""
    with opened(path, sweep) as folder:
        return folder


def refused(path, sweep):
    with pytest.raises(UsageError) as caught:
        begin(path, sweep)
    return str(caught.value)


def test_a_point_is_finished_once_its_result_is_there(sweep_of, tmp_path):
    sweep = sweep_of(probes=True)
    folder = begin(tmp_path / "sweep", sweep)
    first, second = sweep.points()
    finish(folder, first, b"series", falls=0)
    folder = begin(tmp_path / "sweep", sweep)
    assert (folder.holds(first), folder.holds(second)) == (True, False)
    assert folder.read(first)["metrics"] == {"falls": 0}
    assert folder.probes_path(first).read_bytes() == b"series"
    assert json.loads(folder.plan.read_text())["varied"] == {"n_neurons": [2, 20]}


def test_half_written_files_of_points_are_removed_once_the_folder_is_locked(sweep_of, tmp_path):
    folder = begin(tmp_path, sweep_of())
    finish(folder, sweep_of().points()[0], falls=0)
    points = tmp_path / "points"
    left, others = points / ".0.json.12ab34cd.part", {*points.iterdir()}
    left.touch()
    with locked(tmp_path), pytest.raises(UsageError, match="another process"):
        begin(tmp_path, sweep_of())
    assert left.exists()
    begin(tmp_path, sweep_of())
    assert {*points.iterdir()} == others


@pytest.mark.parametrize("finished", [False, True])
def test_a_folder_of_another_sweep_is_refused_with_every_difference_named(
    sweep_of, tmp_path, finished
):
    folder = begin(tmp_path, sweep_of())
    if finished:
        finish(folder, sweep_of().points()[0], falls=0)
    assert refused(tmp_path, sweep_of(seconds=3.0, varied={"n_neurons": (2, 10)})) == (
        f'{tmp_path}: was begun with seconds=2.0, varied={{"n_neurons": [2, 20]}}, but this '
        'sweep has seconds=3.0, varied={"n_neurons": [2, 10]}; '
        "go back to the earlier values, or choose another --out"
    )
    assert json.loads(folder.plan.read_text())["seconds"] == 2.0


def test_settings_in_another_order_are_refused_as_they_name_the_points_differently(
    sweep_of, tmp_path
):
    varied = {"n_neurons": (2, 20), "backend": ("native",)}
    begin(tmp_path, sweep_of(varied=varied))
    begin(tmp_path, sweep_of(varied=dict(varied)))
    turned = sweep_of(varied=dict(reversed(varied.items())))
    assert 'has varied={"backend": ["native"], "n_neurons": [2, 20]}; ' in refused(tmp_path, turned)


def test_many_seeds_are_named_by_the_first_and_the_last(sweep_of, tmp_path):
    begin(tmp_path, sweep_of(seeds=tuple(range(5, 1005))))
    message = refused(tmp_path, sweep_of(seeds=(0, 1)))
    assert "was begun with seeds=[5, ..., 1004], but this sweep has seeds=[0, 1]; " in message
    plan = json.loads((tmp_path / "sweep.json").read_text())
    rows = [{"push": 1.0}] * 20
    (tmp_path / "sweep.json").write_text(json.dumps({**plan, "rows": rows}))
    assert f"rows={json.dumps(rows)}" in refused(tmp_path, sweep_of())


def test_a_plan_with_a_further_entry_is_refused(sweep_of, tmp_path):
    folder = begin(tmp_path, sweep_of())
    plan = json.loads(folder.plan.read_text())
    folder.plan.write_text(json.dumps({**plan, "more": 1}))
    assert "was begun with more=1, but this sweep has more=null" in refused(tmp_path, sweep_of())


def test_a_plan_of_another_spikeport_version_is_refused(sweep_of, tmp_path):
    begin(tmp_path, sweep_of(spikeport="0.1.0"))
    assert refused(tmp_path, sweep_of(spikeport="0.2.0")) == (
        f'{tmp_path}: was begun with spikeport="0.1.0", but this sweep has spikeport="0.2.0"; '
        "go back to the earlier values, or choose another --out"
    )


def test_a_plan_of_other_code_of_the_same_version_is_refused(sweep_of, tmp_path):
    begin(tmp_path, sweep_of())
    other = f"{version('spikeport')}+0123456789ab"
    message = refused(tmp_path, sweep_of(spikeport=other))
    assert f'was begun with spikeport="{own_version()}", but this sweep has' in message


def test_a_plan_of_another_version_of_a_package_is_refused(sweep_of, tmp_path):
    begin(tmp_path, sweep_of(versions={"numpy": "2.1.0", "mujoco": "3.2.0"}))
    asked = sweep_of(versions={"numpy": "2.1.0", "mujoco": "3.3.0"})
    assert refused(tmp_path, asked) == (
        f'{tmp_path}: was begun with versions.mujoco="3.2.0", but this sweep has '
        'versions.mujoco="3.3.0"; go back to the earlier values, or choose another --out'
    )
    (tmp_path / "sweep.json").write_text(json.dumps({"versions": 1}))
    assert "was begun with" in refused(tmp_path, sweep_of())


def test_a_plan_without_a_version_is_of_other_code_and_refused(sweep_of, tmp_path):
    folder = begin(tmp_path, sweep_of())
    plan = json.loads(folder.plan.read_text())
    assert plan.pop("spikeport") == own_version()
    assert plan.pop("versions")["numpy"] == version("numpy")
    folder.plan.write_text(json.dumps(plan))
    message = refused(tmp_path, sweep_of())
    assert message.startswith(f"{tmp_path}: was begun with spikeport=null, versions.")


def test_the_refusal_names_input_files_with_other_contents(sweep_of, tmp_path):
    begin(tmp_path, sweep_of(files={"a.csv": "1", "b.npz": "2", "c.toml": "3"}))
    begin(tmp_path, sweep_of(files={"a.csv": "1", "b.npz": "2", "c.toml": "3"}))
    assert refused(tmp_path, sweep_of(files={"a.csv": "1", "b.npz": "4", "c.toml": "3"})) == (
        f"{tmp_path}: was begun with other contents of b.npz (digest 2 then, 4 now); put the file "
        "back as it was, or choose another --out"
    )
    assert refused(tmp_path, sweep_of(files={"a.csv": "1", "d.npz": "2", "c.toml": "3"})) == (
        f"{tmp_path}: was begun with other contents of b.npz (digest 2 then, none now), d.npz "
        "(digest none then, 2 now); put these files back, or choose another --out"
    )


@pytest.mark.parametrize("files", [[], 5, "a.csv"])
def test_a_plan_whose_files_are_not_a_mapping_is_refused(sweep_of, tmp_path, files):
    folder = begin(tmp_path, sweep_of())
    plan = json.loads(folder.plan.read_text())
    folder.plan.write_text(json.dumps({**plan, "files": files}))
    assert refused(tmp_path, sweep_of()) == (
        f"{tmp_path}/sweep.json: is no plan of a sweep; choose another --out"
    )


def test_the_refusal_of_odd_file_digests_is_a_short_printable_line(sweep_of, tmp_path):
    folder = begin(tmp_path, sweep_of())
    plan = json.loads(folder.plan.read_text())
    folder.plan.write_text(json.dumps({**plan, "files": {"\x1b[2J": ["\n"] * 999}}))
    message = refused(tmp_path, sweep_of())
    assert message.isprintable()
    assert len(message) < 1000


@pytest.mark.parametrize("content", ["[]", "5", "null", "{", "", "\xff"])
def test_a_file_that_is_not_a_plan_is_refused(sweep_of, tmp_path, content):
    (tmp_path / "sweep.json").write_text(content, encoding="latin-1")
    assert refused(tmp_path, sweep_of()) == (
        f"{tmp_path}/sweep.json: is no plan of a sweep; choose another --out"
    )


def test_a_folder_in_which_a_sweep_runs_is_refused(sweep_of, tmp_path):
    with opened(tmp_path, sweep_of()):
        assert refused(tmp_path, sweep_of()) == (
            f"{tmp_path}: another process writes into it; wait until it ends, or choose another "
            "--out"
        )
    begin(tmp_path, sweep_of())


def test_a_folder_with_other_files_is_refused_and_left_as_it_is(sweep_of, tmp_path):
    (tmp_path / "thesis.tex").touch()
    assert refused(tmp_path, sweep_of()) == (
        f"{tmp_path}: holds something other than a sweep or an evaluation; choose another --out"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_folder_that_cannot_be_made_is_refused(sweep_of, tmp_path):
    (tmp_path / "file").touch()
    assert refused(tmp_path / "file", sweep_of()) == (
        f"--out {tmp_path}/file: {tmp_path}/file is no folder; choose another"
    )


@pytest.mark.parametrize(
    "content",
    [
        *("{", "[]", "5", '{"x": 1}', '{"metrics": []}', '{"metrics": {}}'),
        *('{"metrics": {"a": "b"}}', '{"metrics": {"a/b": 1}}', '{"metrics": {"": 1}}'),
        *('{"metrics": {"\\ud800": 1}}', '{"metrics": {"a": 1%s}}' % ("0" * 400)),
        json.dumps({"metrics": {f"m{i}": 1 for i in range(101)}}),
    ],
)
def test_the_error_of_a_damaged_result_names_its_file(sweep_of, tmp_path, content):
    sweep, folder = sweep_of(), SweepFolder(tmp_path)
    finish(folder, sweep.points()[0], falls=0)
    path = folder.result_path(sweep.points()[0])
    path.write_text(content)
    with pytest.raises(UsageError) as caught:
        table(sweep, folder)
    assert str(caught.value) == f"{path}: holds no result; remove it to run its point again"


def test_a_result_must_last_as_long_as_its_schedule_and_not_as_the_sweep_allows(sweep_of, tmp_path):
    sweep = sweep_of(experiment="switch", seconds=60.0, settings={}, varied={"digit": (8,)})
    (point,), folder = sweep.points(), SweepFolder(tmp_path)
    whole = {**result(point, falls=0), "seconds": 26.0}
    folder.write(point, PointFiles(whole, None))
    assert folder.read(point) == whole
    folder.write(point, PointFiles({**whole, "seconds": 60.0}, None))
    with pytest.raises(UsageError, match=r"seconds=60\.0, but this sweep's has 26\.0"):
        folder.read(point)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"seconds": 1.0}, "seconds=1.0, but this sweep's has 2.0"),
        ({"backend": "reference"}, 'backend="reference", but this sweep\'s has "native"'),
        ({"seeds": {"run": 7}}, "seeds.run=7, but this sweep's has 0"),
        ({"seeds": 7}, "seeds.run=null, but this sweep's has 0"),
        ({"settings": {"path": "paper"}}, "settings.network_seed=null, but this sweep's has 0"),
        ({"experiment": "reach"}, 'experiment="reach", but this sweep\'s has "walk"'),
    ],
)
def test_the_error_of_another_runs_result_names_the_difference(
    sweep_of, tmp_path, change, complaint
):
    sweep, folder = sweep_of(), SweepFolder(tmp_path)
    point = sweep.points()[0]
    folder.write(point, PointFiles({**result(point, falls=0), **change}, None))
    with pytest.raises(UsageError) as caught:
        folder.read(point)
    assert str(caught.value) == (
        f"{folder.result_path(point)}: is of a run with {complaint}; "
        "remove it to run its point again"
    )
