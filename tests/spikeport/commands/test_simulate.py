"""``spikeport simulate`` as a user types it: a folder, a table, and refusals."""

import json
import re
import shutil
import signal
import tempfile
from pathlib import Path

import pytest
import recount
import xarray as xr

from spikeport import Simulator
from spikeport.commands import simulate as simulating
from spikeport.compile.report.schema import ReportData
from spikeport.experiments.digests import digest
from spikeport.find_network import find_network
from spikeport.hardware_models.chip import BUILT_IN
from spikeport.simulation import dataset
from tests.helpers import refused_networks

CHAIN = """
import nengo
with nengo.Network(seed=1) as model:
    groups = [nengo.Ensemble(20, 1) for _ in range(20)]
    for pre, post in zip(groups, groups[1:]):
        nengo.Connection(pre, post)
    nengo.Probe(groups[-1])
"""
FILES = ["figure.png", "probes.nc", "report.html", "report.json", "result.json"]


def names(folder):
    # Python keeps the modules that it compiled in a folder beside them.
    return sorted(path.name for path in folder.iterdir() if path.name != "__pycache__")


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.slow
def test_a_run_leaves_a_folder_and_prints_the_errors(spikeport, net_py, tmp_path):
    out = tmp_path / "run"
    options = ("--seconds", "0.1", "--out", out, "--seed", "3", "--set", "n_neurons=30")
    done = spikeport("simulate", f"{net_py}:make", *options)
    assert (done.code, done.err) == (0, "")
    assert names(out) == FILES
    result = json.loads((out / "result.json").read_text())
    assert (result["model"], result["backend"], result["seconds"]) == (
        f"{net_py}:make",
        "native",
        0.1,
    )
    assert result["seeds"] == {"run": 3, "network": 1}
    report = ReportData.model_validate_json((out / "report.json").read_text())
    network = find_network(f"{net_py}:make", ["n_neurons=30"])
    with Simulator(network, seed=3) as sim:
        sim.run(0.1)
    assert report.image_digest == result["image_digest"] == sim.image.digest
    with xr.open_dataset(out / "probes.nc") as read:
        assert (read["neurons"].values == sim.data[network.all_probes[0]]).all()
    (error,) = result["metrics"]["errors"].values()
    assert error == result["metrics"]["largest_error"]
    (row,) = (line.split() for line in done.out.splitlines() if line.startswith("  neurons "))
    assert row[:3] + row[4:6] == ["neurons", "1", "100", f"{100 * error:.2g}", "%"]
    assert float(row[3]) == pytest.approx(
        0.4, abs=0.2
    )  # the input is 0.5, and the value still rises
    assert done.out.splitlines()[-1] == f"written: {out}/ ({', '.join(FILES)})"


@pytest.mark.slow
def test_a_run_prints_a_line_about_its_link(spikeport, net_py, tmp_path):
    def printed(*options):
        short = ("--seconds", "0.02", "--out", tmp_path / "run", "--overwrite")
        done = spikeport("simulate", f"{net_py}:make", *short, *options)
        assert (done.code, done.err) == (0, "")
        (line,) = (one for one in done.out.splitlines() if one.startswith(("board", "replayed")))
        return line

    record = tmp_path / "session.rec"
    line = printed("--backend", "board", "--record", record)
    assert line.startswith("board (native, simulated time): round trip ")
    assert line.endswith("; 0 of 20 steps held, 0 began late")
    assert printed("--backend", "replay", "--replay", record) == f"replayed: {record}"


@pytest.mark.slow
def test_anyone_can_recompute_energy_and_times_from_the_counts(spikeport, tmp_path):
    (tmp_path / "chain.py").write_text(CHAIN)
    out = tmp_path / "run"
    options = ("--seconds", "0.2", "--no-float", "--counts", "--out", out, "-p", "unpacked")
    assert spikeport("simulate", tmp_path / "chain.py", *options).code == 0
    assert names(out / "counts") == ["counts-000000000000.npz", "messages.npz"]
    rows = list(recount.compared(out))
    assert len(rows) == 6
    for *_, recomputed, ours in rows:
        assert float(recomputed) > 0
        assert float(recomputed) == pytest.approx(float(ours), rel=1e-8, abs=0)
    energy = json.loads((out / "result.json").read_text())["energy"]
    assert sum(t["count"] for t in energy["nahuku-fit"]["terms"] if "hop" in t["event"]) > 0
    assert spikeport("simulate", tmp_path / "chain.py", *options, "--overwrite").code == 0


@pytest.mark.slow
def test_a_result_has_the_digests_of_network_and_chip(spikeport, net_py, tmp_path):
    shutil.copy(BUILT_IN / "loihi.toml", tmp_path / "own.toml")
    options = ("--seconds", "0.01", "--out", tmp_path / "run", "--chip", tmp_path / "own.toml")
    assert spikeport("simulate", f"{net_py}:make", *options, "--no-float").code == 0
    named = [Path(net_py), tmp_path / "own.toml"]
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["files"] == {str(path): digest(path) for path in named}
    module = f"{refused_networks.__name__}:with_foreign_neurons"
    options = ("--backend", "reference", "--seconds", "0.01", "--out", tmp_path / "module")
    assert spikeport("simulate", module, *options).code == 0
    assert json.loads((tmp_path / "module" / "result.json").read_text())["files"] == {}


def test_counts_are_refused_for_a_backend_without_cores(spikeport, net_py, tmp_path):
    options = ("--counts", "--backend", "reference", "--out", tmp_path / "run")
    assert spikeport("simulate", f"{net_py}:make", *options) == (
        2,
        "",
        "error: --counts: backend 'reference' has no cores to count on; leave it out, or choose "
        "--backend native\n",
    )


@pytest.mark.parametrize("options", [("--passes", "compact"), ("--offload",), ("--chip", "loihi2")])
def test_options_of_a_compile_are_refused_where_nothing_is_compiled(
    spikeport, net_py, tmp_path, options
):
    done = spikeport(
        *("simulate", f"{net_py}:make", *options),
        *("--backend", "reference", "--out", tmp_path / "run"),
    )
    assert done == (
        2,
        "",
        f"error: {options[0]}: for backend 'reference' nothing is compiled; leave it out, or "
        "choose --backend native\n",
    )


def test_ensembles_are_printed_if_all_of_them_are_moved_to_the_host(spikeport, tmp_path):
    spec = f"{refused_networks.__name__}:only_foreign_neurons"
    options = ("--seconds", "0.01", "--out", tmp_path / "run", "--offload")
    done = spikeport("simulate", spec, *options)
    assert done.code == 0
    assert "ensembles[0] (10 neurons) to the host: SP002 neuron type of ensembles[0]" in done.err
    assert "probes on reference" in done.out


@pytest.mark.slow
def test_offload_moves_refused_ensembles_to_the_host_and_prints_them(spikeport, tmp_path):
    spec = f"{refused_networks.__name__}:with_foreign_neurons"
    options = ("--seconds", "0.05", "--out", tmp_path / "run")
    refused = spikeport("simulate", spec, *options)
    assert refused.code == 1
    assert refused.err.endswith(
        "\nmore: try --offload, which moves ensembles that are refused to the host\n"
    )
    done = spikeport("simulate", spec, *options, "--offload")
    assert done.code == 0
    text = " ".join(done.out.split())
    assert "offloaded: ensembles[1] (10 neurons) to the host: SP002 neuron type of " in text
    report = json.loads((tmp_path / "run" / "report.json").read_text())
    assert [one["id"] for one in report["offloaded"]] == ["SP002"]


def test_a_run_prints_the_hints_of_its_compile(spikeport, tmp_path):
    (tmp_path / "memory.py").write_text(
        "import nengo\n"
        "with nengo.Network(seed=1) as model:\n"
        "    a = nengo.Ensemble(20, 1, label='a')\n"
        "    nengo.Connection(a, a, synapse=0.1)\n",
        encoding="utf-8",
    )
    done = spikeport(
        "simulate", tmp_path / "memory.py", "--seconds", "0.01", "--out", tmp_path / "r"
    )
    assert "hint: SP413 lasting errors: a (gain 1); cure: " in " ".join(done.out.split())


def test_an_earlier_run_is_replaced_only_with_overwrite(spikeport, net_py, tmp_path):
    command = ("simulate", f"{net_py}:make", "--seconds", "0.01", "--out", tmp_path / "run")
    assert spikeport(*command, "--backend", "nengo-loihi").code == 0
    assert "holds a run; choose another --out, or give --overwrite" in spikeport(*command).err
    done = spikeport(*command, "--backend", "reference", "--overwrite")
    assert done.code == 0
    assert names(tmp_path / "run") == [name for name in FILES if not name.startswith("report")]
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["resources"] is None


def test_an_earlier_run_stays_if_the_time_series_of_a_new_one_cannot_be_made(
    spikeport, net_py, tmp_path, monkeypatch
):
    command = ("simulate", f"{net_py}:make", "--seconds", "0.01", "--out", tmp_path / "run")
    assert spikeport(*command).code == 0
    before = contents(tmp_path / "run")
    monkeypatch.setattr(dataset, "dataset", lambda *_: {}["series"])
    with pytest.raises(KeyError, match="series"):
        spikeport(*command, "--overwrite")
    assert contents(tmp_path / "run") == before


@pytest.mark.slow
def test_a_run_too_short_for_a_sample_is_written_and_can_be_viewed(spikeport, tmp_path):
    (tmp_path / "net.py").write_text(CHAIN.replace("groups[-1])", "groups[-1], sample_every=0.05)"))
    out = tmp_path / "run"
    options = ("--seconds", "0.02", "--out", out)
    for backend in "native", "reference":
        done = spikeport(
            "simulate", tmp_path / "net.py", *options, "--backend", backend, "--overwrite"
        )
        assert done.code == 0
        with xr.open_dataset(out / "probes.nc") as read:
            assert read["ensembles[19]"].shape == (0, 1)
    assert spikeport("view", out).code == 0


def test_a_model_without_probes_is_probed_at_its_outputs(spikeport, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loose.py").write_text(
        "import nengo\n"
        "with nengo.Network(seed=1) as model:\n"
        "    nengo.Connection(nengo.Node(1), nengo.Ensemble(20, 1, label='out'))\n",
        encoding="utf-8",
    )
    done = spikeport("simulate", "loose.py", "--seconds", "0.01", "--no-float")
    assert (done.code, done.err) == (
        0,
        "note: the network has no probe; probed here: out\n",
    )
    assert "probes on native" in done.out
    assert "float Nengo" not in done.out
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.startswith("loose-")
    assert json.loads((folder / "result.json").read_text())["metrics"]["errors"] == {"out": None}


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("arm",), "arm is run with its robot, as an experiment: spikeport run reach"),
        (("NET:make", "--seconds", "0"), "--seconds 0: a run is at least one step of 0.001 s, "),
        (("NET:make", "--backend", "analytic"), "unknown backend 'analytic'; choose from: board, "),
        (("NET:make", "--chip", "lohi"), "unknown chip 'lohi'; choose from: "),
        (("NET:make", "-p", "compakt"), "unknown pass or pipeline 'compakt'; choose from: "),
        (("leg",), "unknown network 'leg'; choose from: "),
        (
            (*("NET:make", "--backend", "board"), *("--out", "runs/a", "--record", "runs/a/b")),
            "--record runs/a/b: lies in runs/a, the folder of the run, which holds nothing else; ",
        ),
    ],
)
def test_wrong_use_is_refused_and_leaves_nothing(
    spikeport, net_py, tmp_path, monkeypatch, arguments, reason
):
    monkeypatch.chdir(tmp_path)
    done = spikeport("simulate", *(one.replace("NET", str(net_py)) for one in arguments))
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith(f"error: {reason}")
    assert not list((tmp_path / "runs").glob("*"))


def test_a_node_that_exits_fails_the_command(spikeport, net_py, tmp_path):
    spec, out = f"{net_py}:exits_in_a_node", tmp_path / "out"
    done = spikeport("simulate", spec, "--seconds", "0.01", "--out", out)
    assert (done.code, done.out) == (1, "")
    assert done.err.startswith(f"error: {spec}: its code raised SystemExit: 0 ({net_py}, line ")
    assert not out.exists()


def test_a_node_that_raises_is_named_and_leaves_nothing(spikeport, net_py, tmp_path):
    out = tmp_path / "run"
    done = spikeport("simulate", f"{net_py}:raises_in_a_node", "--out", out)
    assert (done.code, done.out) == (1, "")
    assert "step 5: the network raised ZeroDivisionError: division by zero (" in done.err
    assert re.search(r"net\.py, line \d+\)\n$", done.err)
    assert not out.exists()


@pytest.mark.slow
def test_a_file_name_need_not_be_utf_8_and_a_failed_figure_leaves_the_earlier_run(
    spikeport, tmp_path, monkeypatch
):
    network, out = tmp_path / "ne\udcfft.py", tmp_path / "run"
    network.write_text(CHAIN)
    command = ("simulate", network, "--seconds", "0.01", "--out", out, "--overwrite")
    assert spikeport(*command).code == 0
    before = contents(out)
    assert sorted(before) == FILES

    def undrawn(_figure):
        raise RuntimeError

    monkeypatch.setattr(simulating, "rendered", undrawn)
    with pytest.raises(RuntimeError):
        spikeport(*command)
    assert contents(out) == before


ENDED = """
import os, signal
import nengo

def end(t):
    if t > 0.005:
        os.kill(os.getpid(), signal.SIGTERM)

{begin}
with nengo.Network() as model:
    nengo.Probe(nengo.Ensemble(20, 1))
    nengo.Node(end)
"""


@pytest.mark.parametrize("begin", ["", "end(1.0)"])
def test_sigterm_ends_a_run_and_leaves_no_files(spikeport, tmp_path, monkeypatch, begin):
    network, out = tmp_path / "net.py", tmp_path / "run"
    network.write_text(ENDED.format(begin=begin))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    done = spikeport("simulate", network, "--seconds", "0.1", "--out", out, "--counts")
    assert done.code == 128 + signal.SIGTERM
    assert names(tmp_path) == ["net.py"]


def test_values_that_read_outs_and_inputs_lost_are_hints(spikeport, tmp_path):
    file = tmp_path / "loud.py"
    file.write_text(
        "import nengo\n"
        "with nengo.Network(seed=0) as net:\n"
        "    e = nengo.Ensemble(100, 1)\n"
        "    nengo.Connection(nengo.Node(2.0), e)\n"
        "    out = nengo.Node(size_in=1)\n"
        "    nengo.Connection(e, out, transform=30)\n"
        "    nengo.Probe(out)\n"
    )
    done = spikeport("simulate", file, "--seconds", "0.1", "--out", tmp_path / "run")
    assert done.code == 0
    printed = " ".join(done.out.split())
    assert "hint: SP406 read-out saturation: read-outs (" in printed
    assert "hint: SP408 input saturation: nodes[0] -> ensembles[0] (spikes lost in 46 %" in printed
    assert "SP4" not in done.err  # as warnings, they would be there twice
