"""``spikeport compile`` as a user types it: verdict, files, boards, budgets and loss."""

import contextlib
import errno
import json
import os
import re

import pytest

from spikeport import compile_network
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.report.schema import ReportData
from spikeport.find_network import find_network
from spikeport.hardware_models import chip as chips

RUN = "a run is at least one step of 0.001 s, and at most 1,000,000,000 steps"


SPARSE = """
import nengo
import numpy as np

with nengo.Network(seed=1) as model:
    a, b = (nengo.Ensemble(10, 1, label=name) for name in "ab")
    weights = nengo.Sparse((1, 1), indices=[[0, 0]])
    nengo.Connection(a, b, transform=weights)
"""


def names(folder):
    # Python keeps the modules that it compiled in a folder beside them.
    return sorted(path.name for path in folder.iterdir() if path.name != "__pycache__")


def test_compile_prints_the_cores_and_the_digest(spikeport, net_py):
    image = compile_network(find_network(f"{net_py}:make", [])).image
    done = spikeport("compile", f"{net_py}:make")
    assert done.code == 0
    assert f"Intel Loihi: {image.n_cores} core" in done.out
    assert f"fits chip 'loihi' on {image.n_cores} core" in done.out
    assert f"; image {image.digest[:16]}\n" in done.out
    assert done.err == ""


def test_compile_writes_image_and_report(spikeport, net_py, tmp_path):
    out, report = tmp_path / "build" / "net", tmp_path / "report.json"
    assert spikeport("compile", f"{net_py}:make", "--out", out, "--json", report).code == 0
    assert names(out) == ["image.npz", "report.json"]
    assert (out / "report.json").read_text() == report.read_text()
    image, written = ChipImage.load(out / "image.npz"), json.loads(report.read_text())
    assert written["image_digest"] == image.digest
    assert written["chip"] == image.manifest.chip == "loihi"
    cores = {"used": image.n_cores, "limit": 128, "lower_bound": image.n_cores}
    assert written["resources"]["cores"] == cores
    assert written["resources"]["compartments"]["used"] == image.n_compartments
    assert len(written["cores"]) == image.n_cores


def test_compile_passes_settings_to_the_network(spikeport, net_py, tmp_path):
    report = tmp_path / "report.json"
    settings = ("--set", "n_neurons=33", "--set", "label=many")
    assert spikeport("compile", f"{net_py}:make", *settings, "--json", report).code == 0
    written = json.loads(report.read_text())
    assert "many" in {error["label"] for error in written["quantisation"]}
    assert written["resources"]["compartments"]["used"] >= 33


@pytest.mark.slow
def test_two_processes_compile_the_same_image(start, without_stages, net_py, tmp_path):
    digests = set()
    for name in ("a", "b"):
        process = start("compile", f"{net_py}:make", "--out", tmp_path / name)
        assert without_stages(process.communicate(timeout=120)[1]) == ""
        assert process.returncode == 0
        digests.add(ChipImage.load(tmp_path / name / "image.npz").digest)
    assert digests == {compile_network(find_network(f"{net_py}:make", [])).image.digest}


def test_labels_in_brackets_are_printed_as_they_are(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:make", "--set", "label=[/bold] [red]x", "--cores")
    assert done.code == 0
    assert "[/bold] [red]x" in done.out


def test_every_violation_is_printed_and_no_image_written(spikeport, net_py, tmp_path):
    done = spikeport("compile", f"{net_py}:does_not_fit", "--out", tmp_path / "out")
    assert done.code == 1
    assert done.err == (
        "error: the network does not fit chip 'loihi':\n"
        "  wrong neurons: SP002 neuron type: Tanh, limit LIF, SpikingRectifiedLinear or "
        "RegularSpiking of LIFRate or RectifiedLinear; cure: choose one of these, or keep it on "
        "the host with net.config[ensemble].on_chip = False, after spikeport.add_params(net)\n"
        "  a -> b: SP005 synapse: Alpha, limit Lowpass or None; cure: use nengo.Lowpass(0.02) with "
        "the same group delay, or send decoded values over the host: "
        '`network.config[connection].decode_path = "host"`, after '
        "`spikeport.add_params(network)` and with `-p compact`\n"
        "more: spikeport compile --explain SP002\n"
        "more: try --offload, which moves ensembles that are refused to the host\n"
    )
    assert done.out == ""
    assert names(tmp_path) == ["net.py"]


@pytest.mark.slow
def test_exceeded_limits_are_printed_with_use_and_limit(spikeport, net_py, tmp_path):
    done = spikeport("compile", f"{net_py}:too_large", "--out", tmp_path / "out")
    assert done.code == 1
    assert done.err == (
        "error: the network does not fit chip 'loihi':\n"
        "  loihi: SP201 cores: at least 196, limit 128; cure: use fewer or smaller ensembles or "
        "fewer decoded connections, or at least 2 times the chips, by [limits.chips] of a chip "
        "file (docs/adding.md)\n"
        "more: spikeport compile --explain SP201\n"
    )
    assert names(tmp_path) == ["net.py"]


def test_a_network_with_nothing_for_the_chip_has_a_report_and_no_image(spikeport, net_py, tmp_path):
    done = spikeport("compile", f"{net_py}:empty", "--out", tmp_path / "out")
    assert (done.code, done.err) == (0, "")
    verdict, written = done.out.split("written: ")
    assert " ".join(verdict.split()) == (
        "no ensemble of the network is on the chip (0): all of it runs on the host, in float "
        "Nengo; there is no image"
    )
    assert written == f"{tmp_path / 'out'}/\n"
    assert names(tmp_path / "out") == ["report.json"]
    report = ReportData.model_validate(json.loads((tmp_path / "out" / "report.json").read_text()))
    assert (report.image_digest, report.cores, report.hints[0].id) == ("", [], "SP001")


def test_a_report_without_an_image_replaces_an_earlier_compile(spikeport, net_py, tmp_path):
    out = tmp_path / "out"
    assert spikeport("compile", f"{net_py}:make", "--out", out).code == 0
    assert names(out) == ["image.npz", "report.json"]
    assert spikeport("compile", f"{net_py}:empty", "--out", out).code == 0
    assert names(out) == ["report.json"]


def test_a_network_that_its_builder_refuses_has_a_report(spikeport, net_py, tmp_path):
    script, out = tmp_path / "sparse.py", tmp_path / "out"
    script.write_text(SPARSE)
    files = ("--out", out, "--json", tmp_path / "r.json", "--html", tmp_path / "r.html")
    assert spikeport("compile", f"{net_py}:make", *files).code == 0
    before = (out / "report.json").read_bytes()
    done = spikeport("compile", script, *files)
    assert done.code == 1
    assert done.err.startswith("error: a -> b: nengo-loihi refuses it: ")
    report = ReportData.model_validate(json.loads((tmp_path / "r.json").read_text()))
    assert (report.fits, report.image_digest) == (False, "")
    (violation,) = report.violations
    assert f"a -> b: {violation.used}; cure: {violation.cure}" in done.err
    assert "does not fit chip &#39;loihi&#39;: its builder" in (tmp_path / "r.html").read_text()
    # The folder stays as it was: report and image of the earlier compile.
    assert (out / "report.json").read_bytes() == before
    assert names(out) == ["image.npz", "report.json"]


@pytest.mark.parametrize(
    ("function", "code", "reason"),
    [
        ("raises_value_error", 1, "raised ValueError: the sizes do not match"),
        ("divides_by_zero", 1, "raised ZeroDivisionError: division by zero"),
        ("exits", 1, "raised SystemExit: 0"),
        ("raises_no_exception", 1, "raised Strange: half \\ud83d"),
        ("returns_text", 2, "returned str, expected nengo.Network"),
    ],
)
def test_a_network_function_that_fails_is_named(
    spikeport, net_py, tmp_path, function, code, reason
):
    spec = f"{net_py}:{function}"
    done = spikeport("compile", spec, "--out", tmp_path / "out")
    assert (done.code, done.out) == (code, "")
    place = rf" \({net_py}, line \d+\)" if reason.startswith("raised") else ""
    assert re.fullmatch(re.escape(f"error: {spec}: {reason}") + place + "\n", done.err)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        ("exits_in_a_connection", "its code raised SystemExit: 0"),
        ("makes_errors_of_warnings", "its code makes an error of a warning: "),
    ],
)
def test_code_that_ends_a_compile_is_named(spikeport, net_py, tmp_path, function, reason):
    spec = f"{net_py}:{function}"
    done = spikeport("compile", spec, "--out", tmp_path / "out")
    assert (done.code, done.out) == (1, "")
    assert done.err.startswith(f"error: {spec}: {reason}")
    assert not (tmp_path / "out").exists()


def test_building_a_network_ends_at_the_build_timeout(spikeport, net_py):
    spec = f"{net_py}:builds_for_ever"
    assert spikeport("compile", spec, "--build-timeout", "0.2") == (
        1,
        "",
        f"error: {spec}: did not return a network in 0.2 s, as --build-timeout asks\n",
    )


@pytest.mark.parametrize("limit", ["inf", "nan", "-1", "1e300"])
def test_an_impossible_build_timeout_is_refused(spikeport, net_py, limit):
    done = spikeport("compile", f"{net_py}:make", "--build-timeout", limit)
    assert (done.code, done.out) == (2, "")
    assert "--build-timeout" in done.err


@pytest.mark.parametrize("option", ["--out", "--json"])
def test_an_empty_path_is_refused(spikeport, net_py, option):
    done = spikeport("compile", f"{net_py}:make", option, "")
    assert (done.code, done.out) == (2, "")
    assert "the path is empty" in done.err


def test_unknown_names_of_compile_list_the_known_ones(spikeport, net_py):
    def error(*arguments):
        done = spikeport("compile", *arguments)
        assert (done.code, done.out) == (2, "")
        return done.err

    assert error("leg") == (
        "error: unknown network 'leg'; choose from: FILE.ipynb, FILE.py, FILE.py:NAME, arm, "
        "graph.nir, humanoid, module:NAME, walk\n"
    )
    assert error("arm", "--set", "preset=fat") == (
        "error: unknown preset 'fat'; choose from: lean, paper\n"
    )
    assert error(f"{net_py}:make", "--chip", "lohi") == (
        f"error: unknown chip 'lohi'; choose from: {', '.join(chips.names())}\n"
    )
    assert error(f"{net_py}:make", "--set", "n=1") == (
        f"error: unknown key of network '{net_py}:make' 'n'; choose from: label, n_neurons, tau\n"
    )


def test_a_wrong_chip_file_is_refused_with_path_and_reason(spikeport, net_py, tmp_path):
    text = (chips.BUILT_IN / "loihi.toml").read_text()
    assert 'value = 128\nunit = "1"\n' in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace('value = 128\nunit = "1"\n', "value = -128\n", 1))
    done = spikeport("compile", f"{net_py}:make", "--chip", path)
    assert done.code == 2
    assert done.err == (
        f"error: {path}: not a chip:\n"
        "  limits.cores.value: Input should be greater than or equal to 0\n"
        "  limits.cores.unit: is missing\n"
    )


def test_a_missing_chip_file_is_named(spikeport, net_py, tmp_path):
    path = tmp_path / "no.toml"
    done = spikeport("compile", f"{net_py}:make", "--chip", path)
    assert done == (2, "", f"error: {path}: no such file\n")


def test_compile_refuses_a_file_as_its_folder_and_a_folder_or_device_as_its_file(
    spikeport, net_py, tmp_path
):
    spec = f"{net_py}:make"
    assert spikeport("compile", spec, "--out", net_py) == (
        2,
        "",
        f"error: --out {net_py}: is a file; choose a folder\n",
    )
    for place in (tmp_path, "/dev/null"):
        assert spikeport("compile", spec, "--json", place) == (
            2,
            "",
            f"error: --json {place}: is not a file that can be replaced; choose another\n",
        )
    assert not os.path.isfile("/dev/null")


def test_a_full_disk_leaves_no_image(spikeport, net_py, tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    out = tmp_path / "out"
    done = spikeport("compile", f"{net_py}:make", "--out", out)
    assert done == (1, "", f"error: {out}/image.npz: No space left on device\n")
    assert names(out) == []


@pytest.mark.slow
def test_the_report_is_written_even_if_nobody_reads_the_table(
    start, without_stages, net_py, tmp_path
):
    process = start("compile", f"{net_py}:make", "--json", tmp_path / "report.json")
    process.stdout.close()
    assert without_stages(process.stderr.read()) == ""
    process.stderr.close()
    process.wait(timeout=60)
    assert json.loads((tmp_path / "report.json").read_text())["chip"] == "loihi"


# boards of several chips


@pytest.fixture
def board(tmp_path):
    """Return the chip file of a board with two chips of one core each."""
    text = (chips.BUILT_IN / "loihi.toml").read_text(encoding="utf-8")
    for name, value, limit in (("cores", 128, 1), ("chips", 1, 2)):
        head = f"[limits.{name}]\nvalue = "
        text = text.replace(f"{head}{value}\n", f"{head}{limit}\n")
    path = tmp_path / "board.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_messages_between_chips_are_shown(spikeport, net_py, board, report):
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
    found = report.read()
    assert (found["fits"], found["violations"]) == (True, [])
    assert [one["id"] for one in found["over_budget"]] == ["SP302", "SP303"]


def test_a_budget_without_a_public_figure_is_refused_after_the_report(spikeport, net_py, report):
    options = ("--chip", "loihi2", "--rate-hz", "100", "--max-power", "1", *report.option)
    done = spikeport("compile", f"{net_py}:make", *options)
    assert done.code == 2
    assert "has no public figure to compare it with" in done.err
    assert "fits chip 'loihi2'" in done.out
    assert report.read()["over_budget"] == []


def test_a_budget_that_is_exceeded_is_on_the_page(spikeport, net_py, tmp_path):
    page = tmp_path / "page.html"
    budget = ("--rate-hz", "100", "--max-power", "0.05")
    assert spikeport("compile", f"{net_py}:make", *budget, "--html", page).code == 1
    assert "Over budget" in page.read_text()
    assert "SP302" in page.read_text()


def test_a_budget_that_is_kept_exits_with_0(spikeport, net_py):
    options = ("--rate-hz", "100", "--max-power", "1", "--max-step-us", "1000", "--max-cores", "9")
    assert spikeport("compile", f"{net_py}:make", *options).code == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--max-power", "1"],
            "--max-power needs firing rates: set them with --rate-hz, for example --rate-hz 100, "
            "or measure them with --loss",
        ),
        (
            ["--rate-hz", "1", "--loss", "0.1"],
            "--rate-hz and --loss: the run of --loss has rates of its own; give one",
        ),
        (["--max-cores", "0"], "--max-cores 0: a budget is a positive number"),
        (["--loss", "0"], f"--loss 0: {RUN}"),
        (["--loss", "1e300"], f"--loss 1e+300: {RUN}"),
        (["--loss", "nan"], f"--loss nan: {RUN}"),
    ],
)
def test_contradictory_or_impossible_options_are_refused(spikeport, net_py, options, message):
    done = spikeport("compile", f"{net_py}:make", *options)
    assert done == (2, "", f"error: {message}\n")


# loss


def test_the_loss_of_a_model_without_probes_is_measured_at_its_outputs(spikeport, tmp_path):
    (tmp_path / "loose.py").write_text(
        "import nengo\n"
        "with nengo.Network(seed=1) as model:\n"
        "    nengo.Connection(nengo.Node(1), nengo.Ensemble(20, 1, label='out'))\n",
        encoding="utf-8",
    )
    done = spikeport("compile", tmp_path / "loose.py", "--loss", "0.05")
    assert (done.code, done.err) == (0, "note: the network has no probe; probed here: out\n")
    assert "loss" in done.out
    assert spikeport("compile", tmp_path / "loose.py").err == ""


def test_loss_is_printed_and_written(spikeport, net_py, report):
    done = spikeport("compile", f"{net_py}:make", "--loss", "0.1", *report.option)
    assert (done.code, done.err) == (0, "")
    assert "% off, 100 steps" in done.out
    assert "neurons: weights from the host" in done.out
    assert "energy and time, from the counts of 100 steps" in done.out
    loss = ReportData.model_validate(report.read()).loss
    assert sum(part.share for part in loss.parts) == pytest.approx(1)


@pytest.mark.parametrize(("passes", "is_compiled"), [("as_written", False), ("compact", True)])
def test_a_compile_as_written_is_announced_only_where_passes_rewrite_the_network(
    spikeport, net_py, monkeypatch, passes, is_compiled
):
    stages = []
    bar = contextlib.nullcontext(lambda stage, _share: stages.append(stage))
    monkeypatch.setattr("spikeport.commands.compile.progress_bar", lambda: bar)
    assert spikeport("compile", f"{net_py}:make", "--loss", "0.01", "-p", passes).code == 0
    assert "rounding one part at a time" in stages
    assert ("compiling as written" in stages) is is_compiled


def test_a_node_that_raises_fails_the_run_of_loss_but_not_the_compile(spikeport, net_py):
    spec = f"{net_py}:raises_in_a_node"
    assert spikeport("compile", spec).code == 0
    done = spikeport("compile", spec, "--loss", "0.01")
    assert (done.code, done.out) == (1, "")
    assert done.err.startswith(
        "error: step 5: the network raised ZeroDivisionError: division by zero ("
    )


STEPPING = """
import nengo

class Inputs:
    def __init__(self):
        self.left = [0.5, -0.5] * 25
    def __call__(self, t):
        return self.left.pop()

with nengo.Network(seed=1) as model:
    a, b = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
    nengo.Connection(nengo.Node(Inputs(), size_out=1), a)
    nengo.Connection(a, b)
    nengo.Probe(b)
"""


@pytest.mark.slow
def test_the_run_as_written_begins_with_the_state_that_functions_have_before_a_run(
    spikeport, tmp_path
):
    (tmp_path / "stepping.py").write_text(STEPPING)
    # The inputs are of 50 steps: a second run that went on with them would fail.
    options = ("--loss", "0.05", "-p", "compact")
    done = spikeport("compile", tmp_path / "stepping.py", *options)
    assert (done.code, done.err) == (0, "")


LEARNING = """
import nengo
with nengo.Network(seed=1) as model:
    pre, post, err = (nengo.Ensemble(20, 1, label=label) for label in ("pre", "post", "err"))
    learned = nengo.Connection(pre, post, learning_rule_type=nengo.PES())
    nengo.Connection(post, err)
    nengo.Connection(err, learned.learning_rule)
"""


def test_ensembles_that_stay_on_the_host_are_named(spikeport, tmp_path):
    path, page = tmp_path / "learning.py", tmp_path / "page.html"
    path.write_text(LEARNING)
    done = spikeport("compile", path, "--html", page, "--json", tmp_path / "report.json")
    reason = "kept on the host by nengo-loihi, as a target or error source of learning"
    assert f"on the host: err, post (40 neurons): {reason}" in " ".join(done.out.split())
    assert f"<li>post (20 neurons): {reason}</li>" in page.read_text()
    written = json.loads((tmp_path / "report.json").read_text())["on_host"]
    assert [(one["object"], one["n_neurons"]) for one in written] == [("post", 20), ("err", 20)]


REFUSED_BY_NENGO = """
import nengo
with nengo.Network(seed=1) as model:
    a = nengo.Ensemble(16, 16, neuron_type=nengo.RectifiedLinear())
    transform = nengo.Convolution(1, (4, 4, 1))
    nengo.Connection(a, nengo.Node(size_in=4), transform=transform)
"""


def test_a_network_that_nengo_refuses_on_the_host_is_refused(spikeport, tmp_path):
    (path := tmp_path / "refused.py").write_text(REFUSED_BY_NENGO)
    done = spikeport("compile", path, "--offload", "--out", tmp_path / "out")
    assert done.code == 1
    simulated = spikeport("simulate", path, "--offload", "--out", tmp_path / "run")
    assert simulated.code == 1
    assert done.err.partition(": ")[2].partition(": ")[2] in simulated.err
    assert not (tmp_path / "out").exists()
