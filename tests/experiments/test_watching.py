"""The answers of a run to its viewers, whose files it removes."""

import errno
import threading

import pytest
import xarray as xr

from spikeport.backends.board.link import OWN_STUB, LinkOptions
from spikeport.errors import UsageError
from spikeport.experiments import run_folder, watching
from spikeport.reading.hdf5 import read_dataset


def series(end):
    return xr.Dataset({"probe": ("time", [1.0] * end)}, {"time": [0.001 * i for i in range(end)]})


def test_a_run_that_nobody_watches_makes_no_series(tmp_path):
    def never():
        raise AssertionError

    watching.answer(tmp_path, never)
    assert not any(tmp_path.iterdir())


def test_a_viewer_gets_the_series_so_far_while_a_run_goes_on(tmp_path):
    with run_folder.opened(tmp_path / "run", "reach") as folder:
        assert watching.is_running(folder)
        assert not watching.ask(folder, wait_s=0)
        found = []
        viewer = threading.Thread(target=lambda: found.append(watching.ask(folder, wait_s=60)))
        viewer.start()
        while viewer.is_alive():
            watching.answer(folder, lambda: series(7))
        assert found == [True]
        assert read_dataset(folder / run_folder.SO_FAR).sizes["time"] == 7
        watching.ask(folder, wait_s=0)
        run_folder.write_result(folder, {})
    assert not watching.is_running(folder)
    assert [path.name for path in folder.iterdir()] == ["result.json"]


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "full"), UsageError("read-only")])
def test_an_answer_that_cannot_be_written_warns_and_does_not_end_the_run(
    tmp_path, monkeypatch, error
):
    def unwritten(_path, _found):
        raise error

    monkeypatch.setattr(watching, "write_dataset", unwritten)
    watching.ask(tmp_path, wait_s=0)
    with pytest.warns(UserWarning, match="a viewer gets nothing new: .*(full|read-only)"):
        watching.answer(tmp_path, lambda: series(7))
    assert not any(tmp_path.iterdir())


def test_a_run_whose_folder_is_gone_is_over(tmp_path):
    assert not watching.ask(tmp_path / "run", wait_s=60)
    assert not watching.is_running(tmp_path / "run")


@pytest.mark.slow
@pytest.mark.parametrize(("link", "answers"), [(OWN_STUB, 1), (LinkOptions(real_time=True), 0)])
def test_a_trial_answers_viewers_unless_it_runs_in_real_time(
    run, tmp_path, monkeypatch, link, answers
):
    ends_s = []
    monkeypatch.setattr(
        watching, "write_dataset", lambda _path, found: ends_s.append(float(found.time[-1]))
    )
    watching.ask(tmp_path, wait_s=0)
    # The exact controller has no board, so the simulator would refuse its options.
    monkeypatch.setattr(LinkOptions, "idle", lambda _link, _backend: ())
    done = run(0.2, backend="analytic", link=link)
    assert len(ends_s) == answers
    assert all(0 < end_s < 0.15 for end_s in ends_s)
    assert not (done.folder / run_folder.REQUEST).exists()
