"""Costs before any run, from firing rates that a user states."""

import pytest

from spikeport.compile.report.schema import ReportData


def test_stated_rates_give_energy_and_time(spikeport, net_py, report):
    rates = ("--rate-hz", "100", "--rate-hz", "neurons=50")
    done = spikeport("compile", f"{net_py}:make", *rates, *report.option)
    assert (done.code, done.err) == (0, "")
    assert "energy and time, expected at 100 Hz, neurons 50 Hz" in done.out
    assert "within dt = 1 ms (core 0)" in done.out
    notes = " ".join(done.out.split())
    assert "; not public: message; times not public: message_in nahuku-fit: " in notes
    assert "static: Frady 2020; Blouw 2019 [transcribed]" in done.out
    assert "not shown to be within dt" in " ".join(done.out.split())
    assert (
        "in no total: host processors on the chip, 65 mW (Frady 2020 [transcribed]); " in done.out
    )
    written = report.read()
    assert written["basis"]["rates_hz"] == {"all": 100, "neurons": 50}
    assert written["energy"]["nahuku-fit"]["dynamic"]["power"]["value"] > 0
    assert len(written["energy"]["nahuku-fit"]["cores"]) == len(written["cores"])


def test_the_report_has_the_energy_of_every_module(spikeport, net_py, report):
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


def test_a_rate_of_an_unknown_ensemble_lists_the_known_ones(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:make", "--rate-hz", "neuron=5")
    assert done.code == 2
    assert done.err.startswith("error: unknown ensemble 'neuron'; choose from: host, neurons\n")


def test_the_report_says_which_figures_are_not_public(spikeport, net_py, report):
    options = ("--rate-hz", "100", *report.option)
    done = spikeport("compile", f"{net_py}:make", "--chip", "loihi2", *options)
    assert done.code == 0
    assert "no public figure" in done.out
    assert "not public, not checked: in axons, out axons, " in done.out
    assert "`fits` means that the resources suffice" in done.out
    written = report.read()
    assert written["energy"]["intel-relative"]["dynamic"] is None
    assert written["resources"]["in_axons"]["limit"] is None
    assert ReportData.model_validate(written).chip == "loihi2"


SENDING = """
import nengo
import spikeport

with nengo.Network(seed=1) as network:
    spikeport.add_params(network)
    sender, receiver = nengo.Ensemble(20, 1), nengo.Ensemble(10, 1, label="receiver")
    network.config[sender].on_chip = False
    nengo.Connection(sender.neurons, receiver.neurons, transform=[[0.01] * 20] * 10)
"""


@pytest.mark.parametrize(
    ("rates", "unknown"),
    [((), 20), (("receiver=50",), 20), (("50",), 0), (("receiver=50", "host=50"), 0)],
)
def test_spikes_of_hosts_neurons_are_unknown_unless_their_rate_is_stated(
    spikeport, tmp_path, report, rates: tuple[str, ...], unknown: int
) -> None:
    (tmp_path / "sending.py").write_text(SENDING)
    options = [text for rate in rates for text in ("--rate-hz", rate)]
    done = spikeport("compile", tmp_path / "sending.py", *options, *report.option)
    assert done.code == 0
    assert report.read()["host_io"]["unknown_sources"] == unknown
    assert ("with unknown rates" in " ".join(done.out.split())) == bool(unknown)
