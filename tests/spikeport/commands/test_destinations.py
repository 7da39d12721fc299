"""The places that a compile writes to."""

import json
import os

import pytest

from spikeport.commands.destinations import Destinations
from spikeport.errors import UsageError


@pytest.mark.parametrize("name", ["json", "html"])
def test_a_folder_in_place_of_a_file_is_refused(tmp_path, name):
    to = Destinations(**{"out": None, "json": None, name: tmp_path})
    with pytest.raises(UsageError, match=f"--{name} .*: is not a file that can be replaced"):
        to.check()


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(UsageError, match="is a file; choose a folder"):
        Destinations(out=tmp_path / "out", json=None).check()


def test_the_folder_of_a_run_is_refused(spikeport, net_py, tmp_path):
    """Its report would be that of another image than its result is of."""
    run = tmp_path / "run"
    assert spikeport("simulate", f"{net_py}:make", "--seconds", "0.01", "--out", run).code == 0
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    done = spikeport("compile", f"{net_py}:make", "--out", run)
    message = f"error: --out {run}: holds a run, result.json; choose another folder\n"
    assert (done.code, done.err) == (2, message)
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before


def test_a_folder_that_another_command_writes_into_is_left_alone(spikeport, net_py, tmp_path):
    out = tmp_path / "out"
    with Destinations(out=out, json=None).alone():
        done = spikeport("compile", f"{net_py}:make", "--out", out)
        assert list(out.iterdir()) == []
    assert (done.code, done.err) == (
        2,
        f"error: {out}: another process writes into it; wait until it ends, or choose another "
        "--out\n",
    )
    assert spikeport("compile", f"{net_py}:make", "--out", out).code == 0


def test_a_folder_that_another_process_writes_into_is_refused_before_the_work(tmp_path):
    to = Destinations(out=tmp_path / "out", json=None)
    with to.alone(), pytest.raises(UsageError, match="another process writes into it"):
        to.check()
    to.check()


@pytest.mark.parametrize("option", ["out", "json"])
def test_a_folder_that_cannot_be_written_into_is_refused_before_the_work(
    tmp_path, monkeypatch, option
):
    # Not by chmod: root may write anywhere.
    monkeypatch.setattr(os, "access", lambda _, mode, **__: not mode & os.W_OK)
    path = tmp_path / "new.json"
    with pytest.raises(UsageError) as caught:
        Destinations(**{"out": None, "json": None, option: path}).check()
    assert str(caught.value) == (
        f"--{option} {path}: the folder {tmp_path} cannot be written into; choose another"
    )


@pytest.mark.parametrize("name", ["", ":make"])
def test_the_network_is_not_replaced_by_its_report(spikeport, net_py, name):
    done = spikeport("compile", f"{net_py}{name}", "--json", net_py)
    assert done == (
        2,
        "",
        f"error: --json {net_py}: would replace what the command reads; choose another\n",
    )


@pytest.mark.parametrize(("option", "name"), [("html", "keep.py"), ("json", "page.html")])
def test_a_file_of_another_kind_is_not_replaced(spikeport, net_py, tmp_path, option, name):
    path = tmp_path / name
    path.write_text("mine")
    done = spikeport("compile", f"{net_py}:make", f"--{option}", path)
    message = f"--{option} {path}: exists, and is not a .{option} file; choose another"
    assert done == (2, "", f"error: {message}\n")
    assert path.read_text() == "mine"


@pytest.mark.parametrize(
    ("json", "html", "message"),
    [
        ("out/image.npz", None, "--json {json}: would replace what --out writes"),
        (None, "out/report.json", "--html {html}: would replace what --out writes"),
        ("page", "out/../page", "--html {html}: would replace what --json writes"),
    ],
)
def test_outputs_do_not_replace_each_other(tmp_path, json, html, message):
    asked = {"json": json and tmp_path / json, "html": html and tmp_path / html}
    with pytest.raises(UsageError) as caught:
        Destinations(out=tmp_path / "out", **asked).check()
    assert str(caught.value) == f"{message.format(**asked)}; choose another"


def test_json_and_html_may_name_the_reports_in_the_folder_of_out(tmp_path):
    out = tmp_path / "out"
    Destinations(out=out, json=out / "report.json", html=out / "report.html").check()


def test_reports_are_not_replaced_by_their_difference(spikeport, net_py, tmp_path):
    spikeport("compile", f"{net_py}:make", "--out", tmp_path)
    report = tmp_path / "report.json"
    done = spikeport("diff", tmp_path, tmp_path, "--html", report)
    assert done == (
        2,
        "",
        f"error: --html {report}: would replace what the command reads; choose another\n",
    )


def test_a_network_that_does_not_fit_has_a_report_and_a_page(spikeport, net_py, tmp_path):
    paths = {name: tmp_path / f"report.{name}" for name in ("json", "html")}
    options = [text for name, path in paths.items() for text in (f"--{name}", path)]
    out = tmp_path / "out"
    assert spikeport("compile", f"{net_py}:does_not_fit", "--out", out, *options).code == 1
    written = json.loads(paths["json"].read_text())
    assert (written["fits"], written["cores"], written["image_digest"]) == (False, [], "")
    assert [one["id"] for one in written["violations"]] == ["SP002", "SP005"]
    assert "choose one of these" in paths["html"].read_text()
    assert not out.exists()


def test_the_report_on_a_refused_network_does_not_replace_the_one_beside_another_image(
    spikeport, net_py, tmp_path
):
    assert spikeport("compile", f"{net_py}:make", "--out", tmp_path / "out").code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    page, report = tmp_path / "page.html", tmp_path / "out" / "report.json"
    options = ("--out", tmp_path / "out", "--json", report, "--html", page)
    done = spikeport("compile", f"{net_py}:does_not_fit", *options)
    image = tmp_path / "out" / "image.npz"
    kept = f"not written: {report}, which is the report on {image}\n"
    assert (done.code, done.out) == (1, f"{kept}written: {page}\n")
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before


def test_the_report_on_a_refused_network_is_written_to_a_folder_without_an_image(
    spikeport, net_py, tmp_path
):
    report = tmp_path / "out" / "report.json"
    options = ("--out", tmp_path / "out", "--json", report)
    done = spikeport("compile", f"{net_py}:does_not_fit", *options)
    assert (done.code, done.out) == (1, f"written: {report}\n")
    assert json.loads(report.read_text())["violations"]


def test_diff_writes_a_page_of_two_reports(spikeport, net_py, tmp_path):
    for n in ("20", "30"):
        options = ("--set", f"n_neurons={n}", "--out", tmp_path / n)
        assert spikeport("compile", f"{net_py}:make", *options).code == 0
    page = tmp_path / "pair.html"
    done = spikeport("diff", tmp_path / "20", tmp_path / "30", "--html", page)
    assert (done.code, done.out.splitlines()[0]) == (1, f"written: {page}")
    assert "compartments used" in page.read_text()


def test_a_page_of_an_incomplete_report_is_refused(spikeport, net_py, tmp_path):
    folder = tmp_path / "a"
    spikeport("compile", f"{net_py}:make", "--out", folder)
    part = tmp_path / "result.json"
    whole = json.loads((folder / "report.json").read_text())
    del whole["hints"]
    part.write_text(json.dumps(whole))
    done = spikeport("diff", folder, part, "--html", tmp_path / "pair.html")
    assert done.code == 2
    assert "not the whole report that a page is made of: hints: Field required" in done.err
    assert not (tmp_path / "pair.html").exists()
