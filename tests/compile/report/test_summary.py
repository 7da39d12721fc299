"""A report in short: on a line, on a screen, in a notebook."""

from dataclasses import replace

import nengo
import pytest

from spikeport.compile.check.violation import Violation
from spikeport.compile.pipeline import compile_network
from spikeport.compile.report.summary import resources, verdict
from spikeport.hardware_models import chip as chips


@pytest.fixture(scope="module")
def compilation():
    with nengo.Network(seed=1) as network:
        nengo.Connection(nengo.Node([0.5]), nengo.Ensemble(20, 1, label="<a>"))
    return compile_network(network)


@pytest.fixture(scope="module")
def report(compilation):
    return compilation.report


def test_the_verdict_says_that_the_network_fits_and_names_the_image(compilation, report):
    digest = compilation.image.digest[:16]
    assert verdict(report) == f"fits chip 'loihi' on 1 core (lower bound 1); image {digest}"
    assert repr(report) == f"<Report: {verdict(report)}>"
    assert repr(compilation) == f"<Compilation: {verdict(report)}>"


def test_the_table_has_a_row_for_each_resource(report):
    table = resources(report)
    assert table.title == "Intel Loihi: 1 core"
    assert [row[0] for row in table.rows] == [
        name.replace("_", " ") for name in report.resources() if name != "chips"
    ]
    assert table.rows[1] == ("compartments", "20 / 131,072", "0.0", "20 / 1,024", "2.0", "0")


def test_the_chips_cores_have_no_fullest_core_even_if_an_ensemble_has_the_chips_name():
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(20, 1, label="loihi")
    rows = {row[0]: row[3:] for row in resources(compile_network(network).report).rows}
    assert rows["cores"] == ("", "", "")
    assert rows["compartments"] == ("20 / 1,024", "2.0", "0")


def test_a_report_without_cores_names_no_chips(report):
    table = resources(replace(report, cores=(), placed=(), digest=""))
    assert table.title == "Intel Loihi: 0 cores"


def test_memory_that_cores_share_is_counted_for_the_whole_chip(compilation, report):
    shared = resources(replace(report, chip=chips.get("softcore-up5k"))).rows[-1]
    assert shared == ("memory blocks", "1 / 4", "25.0", "", "", "")


def test_the_printed_report_fits_a_screen_and_ends_with_the_verdict(compilation, report):
    hints = [Violation("SP404", "copies", f"n{i}", "1 of 9", "", "redraw") for i in range(90)]
    text = str(replace(report, hints=(*hints, Violation("SP402", "zeros", "z", "", "", ""))))
    lines = text.splitlines()
    assert len(lines) < 24
    assert max(map(len, lines)) < 80
    assert "hints, in full in report.hints: SP404 copies (90x), SP402 zeros" in lines
    assert verdict(report) in " ".join(lines[-2:])
    assert str(compilation) == str(report)


def test_a_notebook_shows_a_table(compilation, report):
    shown = report._repr_html_()
    assert shown.startswith("<table><caption>Intel Loihi: 1 core</caption>")
    assert shown.count("<tr>") == 1 + len(resources(report).rows)
    assert "fits chip &#x27;loihi&#x27; on 1 core" in shown
    assert compilation._repr_html_() == shown
