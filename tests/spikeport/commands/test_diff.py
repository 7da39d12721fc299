"""``spikeport diff`` of two compiles."""

import json

import pytest

from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.report.refusal import refused_report
from spikeport.experiments.evaluate.interval import of_share
from spikeport.experiments.evaluate.table import TableRow
from spikeport.experiments.run_folder import RESULT_SCHEMA
from spikeport.hardware_models import chip as chips
from tests.helpers.evaluations import write_evaluation


@pytest.fixture
def two(spikeport, net_py, tmp_path):
    """Return folders of two compiles of different sizes."""
    folders = [tmp_path / name for name in "ab"]
    for folder, size in zip(folders, (20, 30), strict=True):
        options = ("--set", f"n_neurons={size}", "--rate-hz", "100", "--out", folder)
        assert spikeport("compile", f"{net_py}:make", *options).code == 0
    return folders


def test_a_report_does_not_differ_from_itself(spikeport, two):
    assert spikeport("diff", two[0], two[0] / "report.json") == (0, "no difference\n", "")
    assert spikeport("diff", two[0], two[0]) == (0, "no difference\n", "")


def test_differing_values_are_listed_with_their_change(spikeport, two):
    done = spikeport("diff", *two)
    assert (done.code, done.err) == (1, "")
    rows = {line.split("  ")[1].strip(): line for line in done.out.splitlines() if "  " in line}
    assert rows["compartments used"].split()[-4:] == ["22", "32", "+45.5", "%"]
    assert {"image", "synapse_bits used", "dynamic power, davies2018 (W)"} < set(rows)
    assert "cores limit" not in rows
    assert "host I/O" not in rows


def test_another_chip_is_a_difference(spikeport, two, net_py, tmp_path):
    other, options = tmp_path / "other", ("--set", "n_neurons=20", "--rate-hz", "100")
    made = spikeport("compile", f"{net_py}:make", *options, "--chip", "loihi2", "--out", other)
    assert made.code == 0
    rows = [line.split() for line in spikeport("diff", two[0], other).out.splitlines()]
    assert ["chip", "loihi", "loihi2"] in rows


def test_more_words_for_the_host_are_a_difference(spikeport, two):
    path = two[1] / "report.json"
    report = json.loads(path.read_text())
    report["host_io"] |= {"words_back": 1000, "verdict": "excluded"}
    path.write_text(json.dumps(report))
    lines = spikeport("diff", *two).out.splitlines()
    assert [line.split()[-1] for line in lines if "host I/O" in line] == ["excluded"]
    assert any("words back / step" in line and "1000" in line for line in lines)


def test_reports_without_host_io_can_be_compared(spikeport, two):
    path = two[0] / "report.json"
    report = json.loads(path.read_text())
    del report["host_io"]
    path.write_text(json.dumps(report))
    for pair in (two, two[::-1]):
        done = spikeport("diff", *pair)
        assert (done.code, done.err) == (1, "")
        assert "compartments used" in done.out
        assert "host I/O" not in done.out


def test_sections_of_one_report_alone_are_named(spikeport, two):
    path = two[0] / "report.json"
    report = json.loads(path.read_text())
    other = two[0] / "without.json"
    other.write_text(json.dumps(report | {"energy": None, "timing": None}))
    for pair in ((path, other), (other, path)):
        assert spikeport("diff", *pair) == (
            0,
            "no difference\nnot compared, since one report lacks them: energy, timing\n",
            "",
        )
    assert spikeport("diff", other, other) == (0, "no difference\n", "")


def test_no_passes_differ_from_some(spikeport, two, reported):
    report = json.loads((two[0] / "report.json").read_text())
    some, none = two[0], reported("none", report, passes=[])
    assert spikeport("diff", none, none) == (0, "no difference\n", "")
    done = spikeport("diff", some, none)
    assert (done.code, rows(done.out)["passes"][-1]) == (1, "none")
    assert "not compared" not in done.out


def test_a_refused_network_has_no_passes_and_no_rounding(spikeport, two, tmp_path):
    path = tmp_path / "refused.json"
    refused = refused_report(chips.get("loihi"), RefusedError("a: bad")).to_dict()
    path.write_text(json.dumps(refused))
    done = spikeport("diff", two[0], path)
    assert done.code == 1
    assert "bad" in done.out
    assert "passes" not in rows(done.out)
    assert not [name for name in rows(done.out) if name.startswith("rounding")]
    assert "not compared, since one report lacks them: passes, quantisation" in done.out


def rows(printed):
    """Return the cells behind the name of each figure in a printed table."""
    lines = (line.split("  ") for line in printed.splitlines())
    cells = ([cell.strip() for cell in line if cell.strip()] for line in lines)
    return {name: values for name, *values in filter(None, cells)}


@pytest.fixture
def reported(tmp_path):
    """Return a function that writes a report with other parts to a file."""

    def write(name, report, **parts):
        path = tmp_path / f"{name}.json"
        path.write_text(json.dumps(report | parts))
        return path

    return write


def test_networks_that_are_refused_differ_by_what_they_break(spikeport, two, reported):
    report = json.loads((two[0] / "report.json").read_text())
    one = {
        "id": "SP005",
        "rule": "synapse",
        "object": "a",
        "used": "Alpha",
        "limit": "",
        "cure": "",
    }
    own = {"id": "", "rule": "refused by the builder", "object": "b", "used": "no", "limit": ""}
    fits = reported("fits", report)
    refused = reported("refused", report, violations=[one])
    other = reported("other", report, violations=[own | {"cure": ""}])
    assert spikeport("diff", refused, refused) == (0, "no difference\n", "")
    done = spikeport("diff", fits, refused)
    assert (done.code, rows(done.out)["a: SP005 synapse"]) == (1, ["-", "Alpha"])
    done = spikeport("diff", refused, other)
    assert (done.code, rows(done.out)["b: refused by the builder"]) == (1, ["-", "no"])
    twice = reported("twice", report, violations=[one, one | {"used": "Triangle"}])
    done = spikeport("diff", refused, twice)
    assert rows(done.out)["a: SP005 synapse"] == ["Alpha", "Alpha; Triangle"]


def test_costs_at_other_rates_say_so(spikeport, two, reported):
    report = json.loads((two[0] / "report.json").read_text())
    at_100, run = reported("at_100", report), {"n_steps": 1, "dt_s": 0.001, "rates_hz": None}
    done = spikeport("diff", at_100, reported("run", report, basis=run))
    found = rows(done.out)["counts of events"]
    assert (done.code, found) == (1, ["expected at all 100 Hz", "a run of 1 step"])
    at_50 = report["basis"] | {"rates_hz": {"all": 50.0, "a": 20.0}}
    done = spikeport("diff", at_100, reported("at_50", report, basis=at_50))
    assert rows(done.out)["counts of events"][1] == "expected at all 50 Hz, a 20 Hz"


def test_losses_against_float_nengo_are_compared(spikeport, two, reported):
    report = json.loads((two[0] / "report.json").read_text())
    loss = {
        "n_steps": 10, "tau_s": 0.02, "network_error": 0.5, "output_error": 0.1, "floor": 0.0,
        "parts": [], "aliasing": {}, "readout_spikes": 0, "saturated_inputs": {},
    }  # fmt: skip
    less = reported("less", report, loss=loss)
    done = spikeport("diff", less, reported("more", report, loss=loss | {"network_error": 0.75}))
    assert done.code == 1
    assert rows(done.out)["loss at the probes, against float Nengo"] == ["0.5", "0.75", "+50.0 %"]


def test_the_result_of_a_simulation_is_compared(spikeport, net_py, tmp_path):
    run = ("simulate", f"{net_py}:make", "--seconds", "0.01", "--no-float", "--out")
    assert spikeport(*run, tmp_path / "run").code == 0
    result = tmp_path / "run" / "result.json"
    assert spikeport("diff", result, result) == (0, "no difference\n", "")
    assert spikeport(*run, tmp_path / "float", "--backend", "reference").code == 0
    done = spikeport("diff", result, tmp_path / "float")
    assert done.code == 2
    assert "the run used no chip" in done.err


def test_conditions_and_metrics_of_runs_are_compared(spikeport, net_py, tmp_path):
    runs = {"a": (), "b": ("--set", "n_neurons=20", "--seed", "7"), "c": ()}
    for name, chosen in runs.items():
        short = ("--seconds", "0.05", "--out", tmp_path / name)
        assert spikeport("simulate", f"{net_py}:make", *short, *chosen).code == 0
    assert spikeport("diff", tmp_path / "a", tmp_path / "c") == (0, "no difference\n", "")
    for file in ("", "result.json"):
        done = spikeport("diff", tmp_path / "a" / file, tmp_path / "b" / file)
        assert done.code == 1
        rows = [line.split() for line in done.out.splitlines()]
        assert ["seed", "of", "the", "run", "0", "7"] in rows
        assert ["setting", "-", "n_neurons=20"] in rows
    file = tmp_path / "c" / "result.json"
    same = spikeport("diff", tmp_path / "a", file)
    assert (same.code, same.out.splitlines()[0]) == (0, "no difference")
    result = json.loads(file.read_text())
    result["metrics"] |= {"steps": [{"late": 2}, 3.0], "real_time_factor": 99.0}
    file.write_text(json.dumps(result))
    rows = [line.split() for line in spikeport("diff", tmp_path / "a", file).out.splitlines()]
    assert [row for row in rows if row[:1] in (["steps[0]"], ["steps[1]"])] == [
        ["steps[0]", "late", "-", "2"],
        ["steps[1]", "-", "3"],
    ]
    assert not any("real_time_factor" in row for row in rows)


def test_a_result_of_something_else_beside_a_report_is_not_that_of_its_run(
    spikeport, two, tmp_path
):
    for content in ("{", '{"model": "pricing", "metrics": {"price": 3}}'):
        (two[0] / "result.json").write_text(content)
        done = spikeport("diff", *two)
        assert (done.code, done.err) == (1, "")
        assert "compartments used" in done.out
        assert "price" not in done.out


def test_the_run_that_a_compile_lacks_is_named(spikeport, net_py, tmp_path):
    run, made = tmp_path / "run", tmp_path / "made"
    assert spikeport("simulate", f"{net_py}:make", "--seconds", "0.01", "--out", run).code == 0
    assert spikeport("compile", f"{net_py}:make", "--out", made).code == 0
    assert "not compared, since one report lacks them: run, " in spikeport("diff", run, made).out


def test_files_that_are_not_reports_are_refused(spikeport, two, tmp_path):
    def error(path):
        done = spikeport("diff", two[0], path)
        assert (done.code, done.out) == (2, "")
        return done.err.removeprefix("error: ").rstrip("\n")

    file = tmp_path / "x.json"
    assert error(file) == f"{file}: no such file or folder"
    file.write_text("{")
    assert error(file).startswith(f"{file}: not JSON: ")
    file.write_text("[]")
    assert error(file) == f"{file}: not a report of a compile, nor of a run"
    report = json.loads((two[1] / "report.json").read_text())
    file.write_text(json.dumps(report | {"schema": 99}))
    assert error(file) == f"{file}: report schema 99, this spikeport reads 2; write it again"
    result = {"schema": RESULT_SCHEMA, "experiment": "reach", "resources": None}
    file.write_text(json.dumps(report | result))
    assert error(file) == (
        f"{file}: the run used no chip, and only figures of chips are compared; give runs on a "
        "backend with a chip"
    )
    assert error(tmp_path) == f"{tmp_path}: has neither report.json nor result.json"


def test_control_characters_in_a_report_are_escaped(spikeport, two):
    path = two[0] / "report.json"
    report = json.loads(path.read_text())
    report["quantisation"][0]["label"] = "\x1b[2J\ud800"
    path.write_text(json.dumps(report))
    done = spikeport("diff", *two)
    assert (done.code, done.err) == (1, "")
    assert done.out.replace("\n", "").isprintable()
    assert r"rounding of weights, \x1b[2J\ud800" in done.out


@pytest.fixture
def evaluations(tmp_path):
    """Return folders of two evaluations; in the second one, 15 of 20 pushed robots fell."""
    folders = [tmp_path / name for name in ("before", "after")]
    for folder, falls in zip(folders, (0, 15), strict=True):
        folder.mkdir()
        row = TableRow({"push": 0.8}, falls, of_share(falls, 20), {})
        write_evaluation(folder / "result.json", row)
    return folders


def test_evaluations_differ_by_what_exceeds_chance(spikeport, evaluations):
    before, after = evaluations
    done = spikeport("diff", before, after)
    assert (done.code, done.err) == (1, "")
    (line,) = (line for line in done.out.splitlines() if "push=0.8" in line)
    assert " ".join(line.split()) == "push=0.8: falls 0 of 20 15 of 20 p = 7.7e-07"
    assert "figures compared, by Fisher's test and intervals of 95 %: 1;" in done.out
    done = spikeport("diff", before, before / "result.json")
    assert (done.code, done.out.splitlines()[0]) == (0, "no difference")


def test_an_evaluation_is_not_compared_with_a_report(spikeport, evaluations, two):
    for pair in ((evaluations[0], two[0]), (two[0], evaluations[0])):
        done = spikeport("diff", *pair)
        assert (done.code, done.out) == (2, "")
        assert "an evaluation and a report have no figures in common" in done.err


def test_an_evaluation_has_no_page(spikeport, evaluations, tmp_path):
    done = spikeport("diff", *evaluations, "--html", tmp_path / "page.html")
    assert done.code == 2
    assert done.err == "error: --html: an evaluation has no page; cure: leave it out\n"
    assert not (tmp_path / "page.html").exists()
