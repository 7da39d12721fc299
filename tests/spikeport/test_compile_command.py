"""What ``spikeport compile`` says of rules, cost and loss; ``spikeport diff`` of two compiles."""

import json

import pytest

from spikeport.compile.check import rules
from spikeport.compile.report.schema import ReportData
from spikeport.hardware_models import chip as chips


@pytest.fixture
def report(tmp_path):
    """Where a compile writes its report, and how to read it."""
    path = tmp_path / "report.json"

    class Report:
        option = ("--json", path)

        def read(self):
            return json.loads(path.read_text())

    return Report()


# rules


def test_explain_says_what_there_is_to_know(spikeport):
    done = spikeport("compile", "--explain", "sp101")
    assert (done.code, done.err) == (0, "")
    rule = rules.get("SP101")
    assert done.out.startswith("SP101 out-axons (limits of one core)\n")
    for text in (rule.meaning, rule.reason, rule.source, *rule.more):
        assert text in done.out
    assert "split the source ensemble into n, or give it fewer connections" in done.out


def test_explain_lists_all_rules_where_there_is_none(spikeport):
    done = spikeport("compile", "--explain", "SP9")
    assert (done.code, done.out) == (2, "")
    assert done.err == f"error: unknown rule 'SP9'; there is: {', '.join(rules.RULES)}\n"


# cost before any run


def test_stated_rates_give_energy_and_time(spikeport, net_py, report):
    rates = ("--rate-hz", "100", "--rate-hz", "neurons=50")
    done = spikeport("compile", f"{net_py}:make", *rates, *report.option)
    assert (done.code, done.err) == (0, "")
    assert "energy and time, expected at 100 Hz, neurons 50 Hz" in done.out
    assert "within dt = 1 ms (core 0)" in done.out
    assert "static: Frady 2020 [transcribed]" in done.out
    written = report.read()
    assert written["basis"]["rates_hz"] == {"all": 100, "neurons": 50}
    assert written["energy"]["nahuku-fit"]["dynamic"]["power"]["value"] > 0
    assert len(written["energy"]["nahuku-fit"]["cores"]) == len(written["cores"])


def test_modules_cost_what_their_neurons_do(spikeport, net_py, report):
    options = ("--rate-hz", "100", "--cores", *report.option)
    done = spikeport("compile", f"{net_py}:make", *options)
    assert done.code == 0
    assert "modules, without messages" in done.out
    written = ReportData.model_validate(report.read())
    names = [one.module for one in written.modules["nahuku-fit"]]
    assert names == list(dict.fromkeys(name for core in written.placed for name in core))
    assert all(one.energy_step.value > 0 for one in written.modules["nahuku-fit"])


def test_faster_neurons_cost_more(spikeport, net_py, report):
    powers = []
    for rate in (10, 200):
        spikeport("compile", f"{net_py}:make", "--rate-hz", rate, *report.option)
        powers.append(report.read()["energy"]["davies2018"]["dynamic"]["power"]["value"])
    assert powers[0] < powers[1]


@pytest.mark.parametrize(
    ("rates", "message"),
    [
        (["fast"], "--rate-hz fast: expected a rate in Hz, or NAME=RATE for an ensemble"),
        (["neurons="], "--rate-hz neurons=: expected a rate in Hz, or NAME=RATE for an ensemble"),
        (["1", "2"], "--rate-hz 2: the rate of all is stated twice"),
        (["a=1", "a=2"], "--rate-hz a=2: the rate of a is stated twice"),
        (["nan"], "rate of all: nan Hz; a neuron spikes from 0 to 1000 times a second"),
        (["-5"], "rate of all: -5 Hz; a neuron spikes from 0 to 1000 times a second"),
    ],
)
def test_rates_that_make_no_sense_are_refused(spikeport, net_py, rates, message):
    options = [f"--rate-hz={rate}" for rate in rates]
    assert spikeport("compile", f"{net_py}:make", *options) == (2, "", f"error: {message}\n")


def test_a_rate_of_an_unknown_ensemble_lists_those_there_are(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:make", "--rate-hz", "neuron=5")
    assert done.code == 2
    assert done.err.startswith("error: unknown ensemble 'neuron'; there is: host, neurons, ")


def test_where_nothing_is_public_the_report_says_so(spikeport, net_py, report):
    options = ("--rate-hz", "100", *report.option)
    done = spikeport("compile", f"{net_py}:make", "--chip", "loihi2", *options)
    assert done.code == 0
    assert "no public figure" in done.out
    assert "not public, not checked: in axons, out axons, " in done.out
    assert "the fit is one of resources" in done.out
    written = report.read()
    assert written["energy"]["intel-relative"]["dynamic"] is None
    assert written["resources"]["in_axons"]["limit"] is None
    assert ReportData.model_validate(written).chip == "loihi2"


# boards of several chips


@pytest.fixture
def board(tmp_path):
    """Two chips of one core each."""
    text = (chips.BUILT_IN / "loihi.toml").read_text(encoding="utf-8")
    for name, value, limit in (("cores", 128, 1), ("chips", 1, 2)):
        head = f"[limits.{name}]\nvalue = "
        text = text.replace(f"{head}{value}\n", f"{head}{limit}\n")
    path = tmp_path / "board.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_goes_between_chips_is_shown(spikeport, net_py, board, report):
    options = ("--chip", board, "-p", "", "--rate-hz", "100", *report.option)
    done = spikeport("compile", f"{net_py}:make", *options)
    assert (done.code, done.err) == (0, "")
    assert "Intel Loihi: 2 cores of 2 chips" in done.out
    (chips_row,) = [line for line in done.out.splitlines() if line.strip().startswith("chips ")]
    assert chips_row.split()[1:] == ["2", "/", "2", "100.0"]
    # 20 neurons at 100 Hz send 2 spikes a step to the read-out on the other chip
    assert "2.0 messages / step: no public figure" in done.out
    assert "fits chip 'loihi' on 2 cores of 2 chips (lower bound 1)" in done.out
    assert ReportData.model_validate(report.read()).resources["chips"].used == 2


def test_a_board_with_too_few_chips_is_refused(spikeport, net_py, board):
    board.write_text(board.read_text().replace("value = 2\n", "value = 1\n", 1))
    done = spikeport("compile", f"{net_py}:make", "--chip", board, "-p", "")
    assert done.code == 1
    assert "loihi: SP201 cores: 2, limit 1; cure: " in done.err


# budgets


def test_a_budget_that_is_exceeded_exits_with_1_after_the_report(spikeport, net_py, report):
    options = ("--rate-hz", "100", "--max-power", "0.05", "--max-step-us", "0.1", *report.option)
    done = spikeport("compile", f"{net_py}:make", *options)
    assert done.code == 1
    assert "fits chip 'loihi'" in done.out
    assert done.err.startswith("error: the network exceeds its budget:\n  loihi: SP302 max-power: ")
    assert "  loihi: SP303 max-step-us: " in done.err
    assert report.read()["chip"] == "loihi"


def test_a_budget_that_is_kept_exits_with_0(spikeport, net_py):
    options = ("--rate-hz", "100", "--max-power", "1", "--max-step-us", "1000", "--max-cores", "9")
    assert spikeport("compile", f"{net_py}:make", *options).code == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--max-power", "1"],
            "--max-power needs firing rates: give them with --rate-hz, as in --rate-hz 100, or "
            "measure them with --loss",
        ),
        (
            ["--rate-hz", "1", "--loss", "0.1"],
            "--rate-hz and --loss: the run of --loss has rates of its own; give one",
        ),
        (["--max-cores", "0"], "--max-cores 0: a budget is a positive number"),
        (["--loss", "0"], "--loss 0: a run is at least one step of 0.001 s"),
        (["--loss", "nan"], "--loss nan: a run is at least one step of 0.001 s"),
    ],
)
def test_contradictory_options_are_refused(spikeport, net_py, options, message):
    done = spikeport("compile", f"{net_py}:make", *options)
    assert done == (2, "", f"error: {message}\n")


# loss


def test_loss_is_printed_and_written(spikeport, net_py, report):
    done = spikeport("compile", f"{net_py}:make", "--loss", "0.1", *report.option)
    assert (done.code, done.err) == (0, "")
    assert "% off, 100 steps" in done.out
    assert "neurons: weights from the host" in done.out
    assert "energy and time, from the counts of 100 steps" in done.out
    loss = ReportData.model_validate(report.read()).loss
    assert sum(part.share for part in loss.parts) == pytest.approx(1)


def test_a_node_that_raises_is_a_failure_of_the_run(spikeport, net_py):
    spec = f"{net_py}:raises_in_a_node"
    assert spikeport("compile", spec).code == 0
    done = spikeport("compile", spec, "--loss", "0.01")
    assert done == (
        1,
        "",
        "error: step 5: the network raised ZeroDivisionError: division by zero\n",
    )


# diff


@pytest.fixture
def two(spikeport, net_py, tmp_path):
    """Folders of two compiles of different sizes."""
    folders = [tmp_path / name for name in "ab"]
    for folder, size in zip(folders, (20, 30), strict=True):
        options = ("--set", f"n_neurons={size}", "--rate-hz", "100", "--out", folder)
        assert spikeport("compile", f"{net_py}:make", *options).code == 0
    return folders


def test_a_report_does_not_differ_from_itself(spikeport, two):
    assert spikeport("diff", two[0], two[0] / "report.json") == (0, "no difference\n", "")


def test_what_differs_is_listed_with_its_change(spikeport, two):
    done = spikeport("diff", *two)
    assert (done.code, done.err) == (1, "")
    rows = {line.split("  ")[1].strip(): line for line in done.out.splitlines() if "  " in line}
    assert rows["compartments used"].split()[-4:] == ["22", "32", "+45.5", "%"]
    assert {"image", "synapse_bits used", "dynamic power, davies2018 (W)"} < set(rows)
    assert "cores limit" not in rows


def test_files_that_are_no_reports_are_refused(spikeport, two, tmp_path):
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
    assert error(file) == f"{file}: report schema 99, this spikeport reads 1; write it again"
    file.write_text(json.dumps(report | {"experiment": "reach", "resources": None}))
    assert error(file) == f"{file}: the run was on no chip: it has no resources to compare"
    assert error(tmp_path) == f"{tmp_path}: has neither report.json nor result.json"
