"""``spikeport compile graph.nir`` and ``simulate graph.nir``: output and refusals."""

import nir
import numpy as np
import pytest
import xarray as xr

from spikeport.commands.agreement import Agreement
from spikeport.commands.console import Console
from spikeport.commands.nir import _table
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import spikes, written


def test_compile_lists_differences_and_measures_agreement_on_spikes_of_a_file(spikeport, tmp_path):
    path = written(tmp_path, nir_graphs.recurrent())
    np.savez(tmp_path / "in.npz", input=spikes(6, 100))
    done = spikeport("compile", path, "--dt", "0.001", "--spikes", tmp_path / "in.npz")
    assert (done.code, done.err) == (0, "")
    assert (
        "differences between the chip and NIR's equations:\n  hidden\n    spikes are 1 step late"
        in done.out
    )
    assert f"input: {tmp_path / 'in.npz'}, 100 steps" in done.out
    rows = [line.split() for line in done.out.splitlines() if line.strip().startswith("hidden ")]
    (_, silent, _, chip, _, wanted, found) = rows[-1]
    assert float(silent) < float(chip) > 98
    assert int(wanted) > 20
    assert abs(int(wanted) - int(found)) <= 3


def test_one_neuron_step_that_differs_is_not_rounded_away():
    found = [Agreement(name, equal, 0.5, 9, 9) for name, equal in (("a", 0.99999), ("b", 1.0))]
    console = Console(width=80)
    with console.capture() as printed:
        console.print(_table(found))
    rows = [row.split()[:5] for row in printed.get().splitlines() if row[2:3] in ("a", "b")]
    assert rows == [["a", "50.00", "%", "99.99", "%"], ["b", "50.00", "%", "100.00", "%"]]


def test_names_of_populations_are_printed_as_they_are(spikeport, tmp_path):
    first, last = nir_graphs.ends(4, 3)
    made = {"w": nir_graphs.weights(3, 4), "[red]x :smile: \x1b": nir_graphs.lif(3)}
    path = written(tmp_path, nir_graphs.graph(input=first, **made, output=last))
    done = spikeport("compile", path, "--dt", "0.001", "--spikes", "random")
    shown = [one for one in done.out.splitlines() if one.startswith(r"  [red]x :smile: \x1b")]
    assert len(shown) == 2  # a difference, and the agreement
    assert "\x1b" not in done.out


def test_compile_describes_random_spikes(spikeport, tmp_path):
    path = written(tmp_path, nir_graphs.recurrent())
    done = spikeport("compile", path, "--set", "dt=0.001", "--set", "parts=1", "--spikes", "random")
    assert done.code == 0
    assert "input: random: each source in 5 % of 256 steps, from seed 0\n" in done.out


def test_a_graph_without_a_time_step_is_refused(spikeport, tmp_path):
    path = written(tmp_path, nir_graphs.recurrent())
    done = spikeport("compile", path)
    assert (done.code, done.out) == (2, "")
    assert done.err == (
        f"error: {path}: a NIR graph has no time step; give that of its equations, in seconds, "
        "with --dt, or --set dt=SECONDS\n"
    )


def test_dt_and_spikes_are_refused_for_networks_that_are_not_nir_graphs(spikeport):
    for option, value in (("--dt", "0.001"), ("--spikes", "random")):
        done = spikeport("compile", "arm", option, value)
        assert done.code == 2
        expected = f"error: {option}: for a NIR graph, a file ending in .nir, not for arm\n"
        assert done.err == expected


def test_the_option_loss_is_refused_for_a_graph_and_spikes_named_instead(spikeport, tmp_path):
    path = written(tmp_path, nir_graphs.recurrent())
    for spikes_given, instead in (
        ([], "for a graph with inputs, give --spikes FILE.npz or --spikes random, which"),
        (["--spikes", "random"], "leave it out: --spikes"),
    ):
        done = spikeport("compile", path, "--dt", "0.001", "--loss", "0.1", *spikes_given)
        assert (done.code, done.out) == (2, "")
        assert done.err == (
            f"error: --loss: {path} has no probe to measure at; {instead} compares all of its "
            "neurons with NIR's equations\n"
        )


@pytest.mark.slow
def test_simulate_plays_spikes_and_lists_differences(spikeport, tmp_path):
    path, out = written(tmp_path, nir_graphs.recurrent()), tmp_path / "run"
    np.savez(tmp_path / "in.npz", input=spikes(6, 60))
    options = ("--dt", "0.001", "--spikes", tmp_path / "in.npz", "--seconds", "0.06", "--out", out)
    done = spikeport("simulate", path, *options)
    assert done.code == 0
    assert (
        "differences between the chip and NIR's equations:\n  hidden\n    spikes are 1 step late"
        in done.out
    )
    assert f"input: {tmp_path / 'in.npz'}, 60 steps\n" in done.out
    with xr.open_dataset(out / "probes.nc") as read:
        assert read["output"].values.any()
        assert read["output in float"].values.any()


def test_spikes_for_a_graph_of_which_nothing_is_on_the_chip_are_not_compared(spikeport, tmp_path):
    first, last = nir_graphs.ends(4, 3)
    one = np.ones(3)
    read_out = nir.LI(tau=0.01 * one, r=one, v_leak=0 * one)
    path = written(
        tmp_path,
        nir_graphs.graph(input=first, w=nir_graphs.weights(3, 4), read=read_out, output=last),
    )
    done = spikeport("compile", path, "--dt", "0.001", "--spikes", "random")
    assert (done.code, done.err) == (0, "")
    assert "--spikes: not compared, since nothing of the graph is on the chip" in done.out
