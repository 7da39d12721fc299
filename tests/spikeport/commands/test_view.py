"""``spikeport view``: the page of a run's folder."""

import errno
import os

import pytest

from spikeport.atomic import locked
from spikeport.commands import view
from spikeport.experiments import run_folder


def test_a_page_is_written_into_the_folder_of_a_run(spikeport, tmp_path):
    import xarray as xr

    values = ("time", [1.0, 2.0], {"units": "V"})
    run_folder.write_probes(tmp_path, xr.Dataset({"probe": values}, {"time": [0.0, 0.001]}))
    run_folder.write_result(tmp_path, {"experiment": "simulate"})
    done = spikeport("view", tmp_path)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith(f"written: {tmp_path / 'view.html'} (")
    assert "simulate: " in (tmp_path / "view.html").read_text()
    assert spikeport("view", tmp_path, "--out", tmp_path / "other.html").code == 0
    assert (tmp_path / "other.html").is_file()
    for name in ("result.json", "probes.nc"):
        before = (tmp_path / name).read_bytes()
        done = spikeport("view", tmp_path, "--out", tmp_path / name)
        message = f"--out {tmp_path / name}: exists, and is not a .html file; choose another"
        assert done == (2, "", f"error: {message}\n")
        assert (tmp_path / name).read_bytes() == before


def test_the_report_of_a_run_is_not_replaced_by_its_page(spikeport, tmp_path):
    run_folder.write_result(tmp_path, {"experiment": "simulate"})
    report = tmp_path / "report.html"
    report.write_text("mine")
    done = spikeport("view", tmp_path, "--out", report)
    message = f"--out {report}: would replace what the run writes; choose another"
    assert done == (2, "", f"error: {message}\n")
    assert report.read_text() == "mine"


def test_a_folder_without_a_run_is_refused(spikeport, tmp_path):
    done = spikeport("view", tmp_path)
    assert done.code == 2
    cure = "cure: name a folder that `run` or `simulate` has written"
    assert done.err == f"error: {tmp_path}: no finished run; {cure}\n"
    states = run_folder.add_last_states(tmp_path, {})
    assert spikeport("view", tmp_path).err == (
        f"error: {tmp_path}: no finished run; the last states of one that did not end are in "
        f"{states}; {cure}\n"
    )


def test_a_file_in_place_of_a_run_is_refused(spikeport, tmp_path):
    (tmp_path / "file").touch()
    for options in ((), ("--live",), ("--out", tmp_path / "page.html")):
        done = spikeport("view", tmp_path / "file", *options)
        assert done == (2, "", f"error: {tmp_path / 'file'}: is a file; name the folder of a run\n")


def test_missing_or_damaged_time_series_are_refused(spikeport, tmp_path):
    run_folder.write_result(tmp_path, {})
    done = spikeport("view", tmp_path)
    assert (done.code, done.out) == (2, "")
    assert "no finished run; cure: " in done.err
    (tmp_path / "probes.nc").write_bytes(b"CDF, or not")
    done = spikeport("view", tmp_path)
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith(f"error: {tmp_path / 'probes.nc'}: cannot be read (")


def test_a_page_that_cannot_be_written_is_not_blamed_on_the_time_series(monkeypatch, tmp_path):
    import xarray as xr

    probes, page = tmp_path / "probes.nc", tmp_path / "v.html"
    run_folder.write_probes(tmp_path, xr.Dataset({}, {"time": [0.0, 0.001]}))

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left on device") as caught:
        view.write(probes, page, "title")
    assert caught.value.filename == str(page)


def test_a_folder_in_which_no_run_goes_on_is_not_watched(spikeport, tmp_path):
    missing = tmp_path / "missing"
    done = spikeport("view", missing, "--live")
    assert done == (2, "", f"error: {missing}: no such folder\n")
    done = spikeport("view", tmp_path, "--live")
    assert done == (2, "", f"error: {tmp_path}: no run goes on in it; cure: leave out --live\n")


def test_a_sweep_that_goes_on_is_not_watched(spikeport, tmp_path):
    (tmp_path / "sweep.json").touch()
    with locked(tmp_path):
        done = spikeport("view", tmp_path, "--live")
    assert done.code == 2
    assert "holds a sweep or an evaluation, which has no live view" in done.err


@pytest.fixture
def watched(monkeypatch, tmp_path):
    """Let a run go on in a folder, and replace its viewer; return how a viewed run ends."""
    live = pytest.importorskip("spikeport.experiments.viewer.live")
    end = {"is_whole": True}

    def watch(folder, title, announce):
        assert (folder, title) == (tmp_path, f"live: {tmp_path}")
        announce("http://127.0.0.1:80/secret/")
        return end["is_whole"]

    monkeypatch.setattr(live, "watch", watch)
    with locked(tmp_path):
        yield end


def test_a_run_under_way_is_watched_at_a_printed_address_and_its_page_is_written(
    spikeport, watched, tmp_path
):
    import xarray as xr

    run_folder.write_probes(tmp_path, xr.Dataset({}, {"time": [0.0, 0.001]}))
    run_folder.write_result(tmp_path, {})
    done = spikeport("view", tmp_path, "--live")
    assert (done.code, done.err) == (0, "")
    address, written = done.out.splitlines()
    assert address == (
        "open http://127.0.0.1:80/secret/ in a browser; it follows the run to its end"
    )
    assert written.startswith(f"written: {tmp_path / 'view.html'} (")


def test_an_earlier_result_is_not_shown_for_a_watched_run_without_one(spikeport, watched, tmp_path):
    run_folder.write_result(tmp_path, {})
    watched["is_whole"] = False
    done = spikeport("view", tmp_path, "--live")
    assert done.code == 2
    assert done.err == (
        f"error: {tmp_path}: the run ended without a result, and an earlier run's is left; cure: "
        "leave out --live to see that one\n"
    )
    assert not (tmp_path / "view.html").exists()
