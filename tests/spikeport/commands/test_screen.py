"""The report on one screen: its last line, its hints and NeuroBench's metrics."""

from dataclasses import replace

import pytest

from spikeport.commands.console import Console
from spikeport.commands.screen import Findings, neurobench_line, print_written, show_findings
from spikeport.compile.check.violation import Violation
from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.pipeline import compile_network
from spikeport.compile.report.loss import Loss
from spikeport.find_network import find_network


@pytest.fixture
def compilation(net_py):
    return compile_network(find_network(f"{net_py}:make", []))


def test_metrics_of_neurobench_are_printed_in_one_line(compilation):
    static = compilation.report.neurobench
    assert neurobench_line(static, None) == (
        f"NeuroBench: footprint {static.footprint_bytes:,} B, "
        f"connection sparsity {static.connection_sparsity:.2f}, "
        f"synaptic operations a step: dense {static.dense:,.0f}"
    )
    activity = expected_activity(compilation.image, Rates(100.0, {}))
    line = neurobench_line(static, activity)
    assert ", effective ACs " in line
    assert ", effective MACs " in line


def test_hints_of_a_run_are_printed_also_if_no_loss_was_measured(compilation, capsys):
    counts = expected_activity(compilation.image, Rates(100.0, {}))
    activity = replace(counts, cut_off={"u -> a": counts.n_steps})
    show_findings(Findings(compilation.report, activity), cores=False)
    printed = " ".join(capsys.readouterr().out.split())
    assert "hint: SP408 input saturation: u -> a (spikes lost in 100 % of steps)" in printed


def test_hints_of_one_rule_are_one_line_that_names_the_first_objects(compilation, capsys):
    hints = [Violation("SP404", "copies", f"n{i}", f"{i} of 9", "", "redraw") for i in range(5)]
    hints.insert(2, Violation("SP402", "zeros", "z", "all", "", "remove"))
    report = compilation.report
    object.__setattr__(report, "hints", tuple(hints))
    show_findings(Findings(report), cores=False)
    printed = " ".join(capsys.readouterr().out.split())
    assert (
        "hint: SP404 copies: n0 (0 of 9), n1 (1 of 9), n2 (2 of 9), 2 more; cure: redraw "
        "hint: SP402 zeros: z (all); cure: remove"
    ) in printed


def test_hints_of_one_rule_with_other_cures_have_lines_of_their_own(compilation, capsys):
    hints = [Violation("SP420", "rate", f"c{i}", "late", "", f"multiply by {i}") for i in (2, 4, 2)]
    show_findings(Findings(replace(compilation.report, hints=tuple(hints))), cores=False)
    printed = " ".join(capsys.readouterr().out.split())
    assert (
        "hint: SP420 rate: c2 (late), c2 (late); cure: multiply by 2 "
        "hint: SP420 rate: c4 (late); cure: multiply by 4"
    ) in printed


def test_the_report_as_data_has_the_hints_of_a_loss_once(compilation):
    activity = replace(expected_activity(compilation.image, Rates(100.0)), readout_spikes=3)
    loss = Loss(
        n_steps=activity.n_steps,
        tau_s=0.02,
        network_error=None,
        output_error=0.5,
        floor=0.0,
        parts=(),
        aliasing={"a": 0.5},
        readout_spikes=3,
        saturated_inputs={"input": 0.5},
    )
    written = Findings(compilation.report, activity, loss=loss).to_dict()
    assert [hint["id"] for hint in written["hints"]] == ["SP406", "SP407", "SP408"]


def test_tables_of_cores_are_shown_only_if_they_are_asked_for(compilation, capsys):
    printed = []
    for cores in (False, True):
        show_findings(Findings(compilation.report), cores)
        printed.append(capsys.readouterr().out)
    assert [" holds " in text for text in printed] == [False, True]


def test_host_io_is_shown_beside_the_step_time(compilation, capsys):
    rates = Rates(100.0, {})
    activity = expected_activity(compilation.image, rates)
    show_findings(Findings(compilation.report, activity, rates), cores=False)
    lines = capsys.readouterr().out.splitlines()
    longest = next(i for i, line in enumerate(lines) if "step time, longest" in line)
    beside = next(line for line in lines[longest:] if "with host I/O" in line)
    assert beside.count("dt = 1 ms not shown") == 2


def test_a_longest_step_at_stated_rates_is_said_to_have_the_mean_spikes(compilation, capsys):
    rates = Rates(100.0, {})
    activity = expected_activity(compilation.image, rates)
    for stated in (rates, None):
        show_findings(Findings(compilation.report, activity, stated), cores=False)
        printed = " ".join(capsys.readouterr().out.split())
        said = "longest step: at stated rates every step has the mean number of spikes"
        assert (said in printed) == (stated is not None)


def test_a_written_folder_is_printed_in_one_line_however_long_it_is(tmp_path, capsys):
    for name in ("b.json", ".lock", "a[1].png"):
        (tmp_path / name).touch()
    print_written(Console(width=20), tmp_path)
    assert capsys.readouterr().out == f"written: {tmp_path}/ (a[1].png, b.json)\n"
