"""The commands as a user types them; what a run computes is tested in tests/experiments."""

import errno
import json
import os
import signal
import subprocess
import sys
import time

import pytest

from spikeport import __version__, compile_network
from spikeport.backends.registry import BACKENDS
from spikeport.compile.image.chip_image import ChipImage
from spikeport.experiments import registry
from spikeport.find_network import find_network
from spikeport.hardware_models import chip as chips

ANALYTIC = ("run", "reach", "--backend", "analytic", "--seconds", "0.05")
COMPILE_OPTIONS = ["--chip", "--set", "--out", "--json", "--rate-hz", "--loss", "--max-cores"]
COMPILE_OPTIONS += ["--max-power", "--max-step-us", "--cores", "--explain"]
RUN_OPTIONS = ["--backend", "--chip", "--seed", "--seconds", "--set", "--out", "--overwrite"]
RUN_OPTIONS.append("--video")
REACH_BACKENDS = ", ".join(sorted(registry.get("reach").backends))


def names(folder):
    return sorted(path.name for path in folder.iterdir())


# the command line as a whole


def test_version(spikeport):
    assert spikeport("--version") == (0, f"spikeport {__version__}\n", "")


def test_no_command_prints_help_as_wrong_use(spikeport):
    done = spikeport()
    assert done.code == 2
    assert "Usage: spikeport" in done.out


@pytest.mark.parametrize(
    ("command", "options"),
    [
        ([], ["--version", "compile", "diff", "run", "chips", "backends", "doctor"]),
        (["compile"], COMPILE_OPTIONS),
        (["diff"], ["--help"]),
        (
            ["run"],
            RUN_OPTIONS,
        ),
        (["chips"], ["--help"]),
        (["backends"], ["--help"]),
        (["doctor"], ["--help"]),
    ],
)
def test_help_names_every_option(spikeport, command, options):
    done = spikeport(*command, "--help")
    assert done.code == 0
    assert [option for option in options if option not in done.out] == []


@pytest.mark.parametrize(
    "arguments",
    [
        ["fly"],
        ["compile"],
        ["run"],
        ["compile", "arm", "--core", "3"],
        ["run", "reach", "--seed", "-1"],
        ["run", "reach", "--seed", str(2**32)],
        ["run", "reach", "--seed", "one"],
        ["run", "reach", "--seconds", "long"],
    ],
)
def test_wrong_words_exit_with_2(spikeport, arguments):
    done = spikeport(*arguments)
    assert done.code == 2
    assert "Usage: spikeport" in done.err


def test_a_reader_that_leaves_early_gives_no_traceback(start):
    process = start("chips")
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    process.wait(timeout=60)


# compile


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


def test_two_processes_compile_the_same_image(start, net_py, tmp_path):
    digests = set()
    for name in ("a", "b"):
        process = start("compile", f"{net_py}:make", "--out", tmp_path / name)
        assert process.communicate(timeout=120)[1] == ""
        assert process.returncode == 0
        digests.add(ChipImage.load(tmp_path / name / "image.npz").digest)
    assert digests == {compile_network(find_network(f"{net_py}:make", [])).image.digest}


def test_labels_in_brackets_are_printed_as_they_are(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:make", "--set", "label=[/bold] [red]x", "--cores")
    assert done.code == 0
    assert "[/bold] [red]x" in done.out


def test_every_violation_is_printed_and_nothing_written(spikeport, net_py, tmp_path):
    out, report = tmp_path / "out", tmp_path / "report.json"
    done = spikeport("compile", f"{net_py}:does_not_fit", "--out", out, "--json", report)
    assert done.code == 1
    assert done.err == (
        "error: the network does not fit chip 'loihi':\n"
        "  wrong neurons: SP002 neuron type: Tanh, limit LIF, SpikingRectifiedLinear or "
        "RegularSpiking of LIFRate or RectifiedLinear; cure: choose one of these, or keep it on "
        "the host with net.config[ensemble].on_chip = False\n"
        "  a -> b: SP005 synapse: Alpha, limit Lowpass or None; cure: use nengo.Lowpass(tau) with "
        "the same group delay\n"
        "more: spikeport compile --explain SP002\n"
    )
    assert done.out == ""
    assert names(tmp_path) == ["net.py"]


def test_exceeded_limits_are_printed_with_use_and_limit(spikeport, net_py, tmp_path):
    done = spikeport("compile", f"{net_py}:too_large", "--out", tmp_path / "out")
    assert done.code == 1
    assert done.err == (
        "error: the network does not fit chip 'loihi':\n"
        "  loihi: SP201 cores: 196, limit 128; cure: use fewer or smaller ensembles or fewer "
        "decoded connections, or 2 such boards\n"
        "more: spikeport compile --explain SP201\n"
    )
    assert names(tmp_path) == ["net.py"]


def test_a_network_without_ensembles_does_not_fit(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:empty")
    assert done.code == 1
    assert "network: SP001 on-chip ensembles: 0, limit at least 1; cure: " in done.err


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        ("raises_value_error", "raised ValueError: the sizes do not match"),
        ("divides_by_zero", "raised ZeroDivisionError: division by zero"),
        ("returns_text", "returned str, expected nengo.Network"),
    ],
)
def test_a_network_function_that_fails_is_wrong_use(spikeport, net_py, function, reason):
    spec = f"{net_py}:{function}"
    assert spikeport("compile", spec) == (2, "", f"error: {spec}: {reason}\n")


def test_unknown_names_of_compile_list_what_there_is(spikeport, net_py):
    def error(*arguments):
        done = spikeport("compile", *arguments)
        assert (done.code, done.out) == (2, "")
        return done.err

    assert error("leg") == (
        "error: unknown network 'leg'; there is: arm, humanoid, module:function, "
        "path/to/file.py:function, walk\n"
    )
    assert error("arm", "--set", "preset=fat") == (
        "error: unknown preset 'fat'; there is: lean, paper\n"
    )
    assert error(f"{net_py}:make", "--chip", "lohi") == (
        f"error: unknown chip 'lohi'; there is: {', '.join(chips.names())}\n"
    )
    assert error(f"{net_py}:make", "--set", "n=1") == (
        f"error: unknown key of network '{net_py}:make' 'n'; there is: label, n_neurons, tau\n"
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


def test_compile_does_not_write_to_a_place_of_another_kind(spikeport, net_py, tmp_path):
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


def test_the_report_is_written_even_if_nobody_reads_the_table(start, net_py, tmp_path):
    process = start("compile", f"{net_py}:make", "--json", tmp_path / "report.json")
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    process.wait(timeout=60)
    assert json.loads((tmp_path / "report.json").read_text())["chip"] == "loihi"


# run


def test_run_writes_its_folder_and_prints_the_metrics(spikeport, tmp_path):
    out = tmp_path / "a" / "run"
    done = spikeport(*ANALYTIC, "--out", out)
    assert (done.code, done.err) == (0, "")
    assert names(out) == ["figure.png", "probes.nc", "result.json"]
    result = json.loads((out / "result.json").read_text())
    assert [name for name in result["metrics"] if name not in done.out] == []
    assert f"written: {out}/ (figure.png, probes.nc, result.json)\n" in done.out
    assert result["command"] == ["spikeport", *ANALYTIC, "--out", str(out)]


def test_a_run_without_out_goes_into_a_folder_of_its_own(spikeport, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert spikeport(*ANALYTIC).code == 0
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.startswith("reach-")
    assert (folder / "result.json").is_file()


def test_unknown_names_of_run_list_what_there_is(spikeport, tmp_path):
    def error(*arguments):
        done = spikeport("run", *arguments, "--out", tmp_path / "run")
        assert (done.code, done.out) == (2, "")
        return done.err

    assert error("dance") == (
        f"error: unknown experiment 'dance'; there is: {', '.join(sorted(registry.EXPERIMENTS))}\n"
    )
    assert error("reach", "--backend", "board") == (
        f"error: unknown backend of reach 'board'; there is: {REACH_BACKENDS}\n"
    )
    assert error("reach", "--chip", "lohi") == (
        f"error: unknown chip 'lohi'; there is: {', '.join(chips.names())}\n"
    )
    assert error("reach", "--set", "box=huge") == (
        "error: unknown box 'huge'; there is: large, small, x0:x1,y0:y1,z0:z1 (m)\n"
    )
    assert error("reach", "--set", "preset=fat") == (
        "error: unknown preset 'fat'; there is: lean, paper\n"
    )
    assert error("reach", "--set", "n=1") == (
        "error: unknown key of experiment 'reach' 'n'; "
        "there is: appearance, box, calibrated, cb, m1, network_seed, preset, s1\n"
    )
    assert error("reach", "--set", "m1=0") == (
        "error: m1=0: the number of neurons must be at least 1\n"
    )
    assert error("reach", "--set", "network_seed=-1") == (
        "error: network_seed=-1: a seed must be from 0 to 4294967295\n"
    )
    assert names(tmp_path) == []


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "0.004"])
def test_a_time_that_cannot_be_simulated_is_refused(spikeport, tmp_path, seconds):
    done = spikeport(*ANALYTIC[:4], "--seconds", seconds, "--out", tmp_path / "run")
    assert done == (2, "", f"error: --seconds {seconds}: reach simulates at least 0.005 s\n")
    assert names(tmp_path) == []


def test_out_that_is_a_file_is_refused(spikeport, tmp_path):
    out = tmp_path / "file"
    out.write_text("mine")
    done = spikeport(*ANALYTIC, "--out", out, "--overwrite")
    assert done == (2, "", f"error: {out}: cannot be made (File exists)\n")
    below = out / "run"
    done = spikeport(*ANALYTIC, "--out", below)
    assert done == (2, "", f"error: {below}: cannot be made (Not a directory)\n")
    assert out.read_text() == "mine"


def test_out_that_cannot_be_written_to_is_refused_before_the_run(spikeport, tmp_path, monkeypatch):
    # not by chmod: root may write anywhere
    monkeypatch.setattr(os, "access", lambda _, mode, **__: not mode & os.W_OK)
    done = spikeport(*ANALYTIC, "--out", tmp_path)
    assert done == (2, "", f"error: {tmp_path}: cannot be written to; choose another --out\n")


def test_overwrite_replaces_a_run(spikeport, tmp_path):
    first, second = (*ANALYTIC, "--out", tmp_path), (*ANALYTIC, "--seed", "1", "--out", tmp_path)
    assert spikeport(*first).code == 0
    before = (tmp_path / "result.json").read_text()
    assert spikeport(*second) == (
        2,
        "",
        f"error: {tmp_path}: holds a run; choose another --out, or give --overwrite\n",
    )
    assert (tmp_path / "result.json").read_text() == before
    assert spikeport(*second, "--overwrite").code == 0
    assert json.loads((tmp_path / "result.json").read_text())["seeds"]["run"] == 1


def test_overwrite_replaces_nothing_but_runs(spikeport, tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    (tmp_path / "result.json").write_text("{}")
    done = spikeport(*ANALYTIC, "--out", tmp_path, "--overwrite")
    assert done == (2, "", f"error: {tmp_path}: holds more than a run; choose another --out\n")
    assert names(tmp_path) == ["result.json", "thesis.tex"]


def test_an_earlier_run_outlives_one_that_does_not_fit(spikeport, tmp_path):
    out = tmp_path / "run"
    assert spikeport(*ANALYTIC, "--out", out).code == 0
    before = (out / "result.json").read_text()
    text = (chips.BUILT_IN / "loihi.toml").read_text()
    small = tmp_path / "small.toml"
    small.write_text(text.replace("value = 128", "value = 1", 1).replace('"loihi"', '"small"', 1))
    sizes = ("--set", "m1=1", "--set", "cb=1", "--set", "s1=1")
    done = spikeport("run", "reach", *sizes, "--chip", small, "--out", out, "--overwrite")
    assert done.code == 1
    assert done.err.startswith(
        "error: the network does not fit chip 'small':\n  small: SP201 cores: "
    )
    assert (out / "result.json").read_text() == before


def test_a_full_disk_leaves_no_result(spikeport, tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    out = tmp_path / "run"
    done = spikeport(*ANALYTIC, "--out", out)
    assert done == (1, "", f"error: {out}/probes.nc: No space left on device\n")
    assert names(tmp_path) == []


def test_an_interrupted_run_says_so_and_leaves_no_result(start, tmp_path):
    out = tmp_path / "run"
    process = start(
        *("run", "reach", "--backend", "analytic", "--seconds", "3600", "--out", out),
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60
    while not out.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert (process.returncode, stdout) == (130, "")
    assert stderr == "error: interrupted; nothing that was under way is complete\n"
    assert not out.exists()


# chips, backends, doctor


def test_chips_lists_every_chip_with_its_limits(spikeport):
    done = spikeport("chips")
    assert done.code == 0
    for name in chips.names():
        assert f"{name}: {chips.get(name).title}" in done.out
    assert "Davies 2018" in done.out


def test_sources_are_printed_whole_where_columns_are_narrow(monkeypatch, spikeport):
    wide = spikeport("chips").out
    assert "nengo-loihi 1.1.0, hardware/nxsdk_objects.py" in wide
    assert "…" not in wide


def test_backends_lists_every_backend(spikeport):
    done = spikeport("backends")
    assert (done.code, done.err) == (0, "")
    assert [name for name in (*BACKENDS, "analytic") if f"  {name} " not in done.out] == []


def test_doctor_finds_what_is_installed(spikeport):
    done = spikeport("doctor")
    assert (done.code, done.err) == (0, "")
    assert "nengo-loihi" in done.out
    assert "1.1.0" in done.out


def test_doctor_says_how_to_get_what_is_missing(spikeport, monkeypatch):
    from spikeport.commands import doctor

    found = doctor._version
    monkeypatch.setattr(doctor, "_version", lambda name: "" if name == "xarray" else found(name))
    done = spikeport("doctor")
    assert done.code == 0
    (row,) = (line for line in done.out.splitlines() if "xarray" in line)
    assert row.split() == ["xarray", "missing", "pip", "install", "'spikeport[robot]'"]


def test_doctor_fails_if_something_required_is_missing(spikeport, monkeypatch):
    from spikeport.commands import doctor

    monkeypatch.setattr(doctor, "_version", lambda name: "" if name == "numpy" else "1")
    assert spikeport("doctor").code == 1


def test_backends_says_how_to_get_a_missing_experiment(spikeport, monkeypatch):
    def absent(name):
        raise ModuleNotFoundError(f"No module named '{name}'", name="xarray")

    monkeypatch.setattr(registry, "import_module", absent)
    done = spikeport("backends")
    assert done.code == 0
    reason = (
        "experiment 'reach' needs the package xarray, which is absent; "
        "install it with: pip install 'spikeport[robot]'"
    )
    assert reason in done.out
    assert spikeport(*ANALYTIC) == (2, "", f"error: {reason}\n")


def test_help_does_not_wait_for_nengo():
    code = (
        "import sys; from spikeport import cli\n"
        "try: cli.app(['--help'])\n"
        "except SystemExit: sys.exit('nengo' in sys.modules)"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, timeout=60)
    assert process.returncode == 0
