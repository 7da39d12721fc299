"""The page of a report: its content, its lack of requests, and its behaviour in a browser."""

import html
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from spikeport.compile.check.violation import Violation
from spikeport.compile.report.page import by_rule, write_page, write_pair
from spikeport.compile.report.report import Report
from spikeport.hardware_models import chip as chips
from tests.helpers.browsers import browser, tab_of

VOID = {"meta", "br", "input", "link", "img", "hr"}


class Tree(HTMLParser):
    """A parser of a page, which checks that every element is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.targets: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self.ids += [named["id"]] if named.get("id") else []
        self.targets += [named["href"]] if named.get("href") else []
        assert not {"src", "srcset", "onclick"} & named.keys()
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_data(self, data: str) -> None:
        self.text += data


def read(path: Path) -> Tree:
    tree = Tree()
    tree.feed(path.read_text())
    assert tree.open == []
    return tree


@pytest.fixture
def page(whole: dict[str, Any], tmp_path: Path) -> Path:
    write_page(tmp_path / "report.html", whole, "a <b>chain</b>")
    return tmp_path / "report.html"


def test_a_page_has_the_figures_of_the_report(page: Path, whole: dict[str, Any]) -> None:
    text = read(page).text
    assert whole["verdict"] in text
    assert "a <b>chain</b>" in text
    assert "Outputs are 50 % off" in text
    for core in whole["cores"]:
        assert html.escape(core["label"]) in page.read_text()
    for hint in whole["hints"]:
        assert hint["id"] in text


def test_a_page_says_that_steps_with_host_io_are_not_shown_to_take_dt(page: Path) -> None:
    text = read(page).text
    assert "Host I/O of a step" in text
    assert "not shown: published steps with host I/O take 0.95 ms to 9 ms" in text
    assert text.count("dt = 1 ms not shown") == 2  # below the longest step of two calibrations


def test_a_page_names_the_sources_of_all_its_costs(whole: dict[str, Any], tmp_path: Path) -> None:
    costs = {name: dict(whole[name]) for name in ("energy", "timing")}
    costs["energy"]["davies2018"] = dict(whole["energy"]["davies2018"], dynamic_run=None)
    write_page(tmp_path / "report.html", whole | costs, "without dynamic energy")
    text = read(tmp_path / "report.html").text
    assert "Sources: Frady 2020; Blouw 2019 [transcribed]; TU Delft 2024 [abstract]" in text
    assert "Sources: SANA-FE, arch/loihi.yaml [code]; Frady 2020; " in text
    costs["energy"] |= {
        name: dict(one, static=None, system=None) for name, one in costs["energy"].items()
    }
    costs["timing"]["davies2018"] = None
    write_page(tmp_path / "report.html", whole | costs, "without any figure")
    assert "Sources: none is public." in read(tmp_path / "report.html").text


def test_a_core_that_is_almost_full_is_not_full(whole: dict[str, Any], tmp_path: Path) -> None:
    cores = [core | {"compartments": 1020} for core in whole["cores"]]
    write_page(tmp_path / "report.html", whole | {"cores": cores}, "almost full")
    text = read(tmp_path / "report.html").text
    assert "99.6 % of compartments" in text
    assert "100.0 %" not in text


def test_tables_of_the_largest_items_say_how_many_there_are(
    whole: dict[str, Any], tmp_path: Path
) -> None:
    errors = [whole["quantisation"][0] | {"label": f"b{i}", "weights": 0.1} for i in range(1300)]
    write_page(tmp_path / "report.html", whole | {"quantisation": errors}, "many blocks")
    text = read(tmp_path / "report.html").text
    assert "The 12 largest of 1,300." in text
    assert text.count(" largest of ") == 1
    write_page(tmp_path / "report.html", whole | {"quantisation": errors[:12]}, "few blocks")
    assert " largest of " not in read(tmp_path / "report.html").text


def test_a_page_on_a_run_of_one_step_says_so(whole: dict[str, Any], tmp_path: Path) -> None:
    basis = {"n_steps": 1, "dt_s": 0.001, "rates_hz": None}
    write_page(tmp_path / "report.html", whole | {"basis": basis}, "one step")
    assert "From the exact counts of 1 step." in read(tmp_path / "report.html").text


def test_a_page_says_that_steps_at_stated_rates_have_the_mean_spikes(page: Path) -> None:
    assert "At these rates every step has the mean number of spikes" in read(page).text


def test_a_page_names_the_events_without_a_public_energy_or_time(page: Path) -> None:
    text = " ".join(read(page).text.split())
    assert text.count("No public figure: message. No public time: message in.") == 1


def test_expected_counts_are_not_rounded_to_whole_ones(
    whole: dict[str, Any], page: Path, tmp_path: Path
) -> None:
    operations = whole["energy"]["davies2018"]["terms"][0]
    assert f"energy of a stepsynaptic operation{operations['count']:.3g}" in read(page).text
    operations["count"] = 0.25
    whole["basis"]["n_steps"] = 4
    write_page(tmp_path / "few.html", whole, "few")
    assert "energy of 4 stepssynaptic operation0.25" in read(tmp_path / "few.html").text


def test_the_page_of_a_report_without_an_image_has_no_host_io(tmp_path: Path) -> None:
    report = Report(chips.get("loihi"), "", (), (), ()).to_dict()
    assert report["host_io"] is None
    write_page(tmp_path / "report.html", report, "nothing")
    text = read(tmp_path / "report.html").text
    assert report["verdict"] in text
    assert "Host I/O" not in text


def test_links_lead_to_rows_of_the_page_and_ids_are_unique(page: Path) -> None:
    tree = read(page)
    assert len(set(tree.ids)) == len(tree.ids)
    assert tree.targets
    assert {target.removeprefix("#") for target in tree.targets} <= set(tree.ids)


def test_a_page_makes_no_requests(page: Path) -> None:
    content = page.read_text()
    assert not re.search(r"https?://|@import|url\(", content)
    assert "default-src 'none'" in content


def test_labels_of_a_network_are_escaped_on_the_page(whole: dict[str, Any], tmp_path: Path) -> None:
    label = "</title><script>alert(1)</script>"
    spoilt = whole | {"cores": [core | {"label": label} for core in whole["cores"]]}
    spoilt["placed"] = [[label] for _ in whole["cores"]]
    write_page(tmp_path / "report.html", spoilt, label)
    assert "<script>alert" not in (tmp_path / "report.html").read_text()
    read(tmp_path / "report.html")


def test_the_page_of_a_network_that_does_not_fit_has_violations_and_cures(tmp_path: Path) -> None:
    broken = [
        Violation("SP002", "neuron type", name, "Tanh", "LIF", "choose one") for name in ("a", "b")
    ]
    report = Report(chips.get("loihi"), "", (), (), (), violations=tuple(broken)).to_dict()
    write_page(tmp_path / "report.html", report, "net")
    text = read(tmp_path / "report.html").text
    assert "does not fit chip 'loihi': breaks SP002" in text
    assert "SP002 neuron type: 2 times" in text
    assert "Cure: choose one" in text
    assert "b: Tanh, limit LIF" in text


def test_cures_that_differ_are_in_the_rows_of_their_violations(tmp_path: Path) -> None:
    broken = [
        Violation("SP102", "in-axons", f"core {n}", str(n), "20", f"split it into {n // 20 + 1}")
        for n in (30, 49)
    ]
    report = Report(chips.get("loihi"), "", (), (), (), violations=tuple(broken)).to_dict()
    write_page(tmp_path / "report.html", report, "net")
    text = read(tmp_path / "report.html").text
    assert "Cure:" not in text
    assert "core 30: 30, limit 20; cure: split it into 2" in text
    assert "core 49: 49, limit 20; cure: split it into 3" in text


def test_a_page_of_two_reports_has_both_and_their_differences(
    whole: dict[str, Any], tmp_path: Path
) -> None:
    changes = [("cores used", "4", "3", "-25.0 %")]
    write_pair(tmp_path / "pair.html", {"before": whole, "after": whole}, changes)
    tree = read(tmp_path / "pair.html")
    assert tree.text.count(whole["verdict"]) == 2
    assert all(text in tree.text for text in changes[0])
    assert len(set(tree.ids)) == len(tree.ids)
    write_pair(tmp_path / "pair.html", {"a": whole, "b": whole}, [])
    assert "No figure differs." in read(tmp_path / "pair.html").text


def test_rows_are_grouped_by_rule() -> None:
    rows = [{"id": i, "rule": "r", "cure": f"c{n}"} for n, i in enumerate(("SP2", "SP1", "SP2"))]
    found = by_rule(rows)
    assert [(one.id, one.cure) for one in found] == [("SP1", "c1"), ("SP2", "")]
    assert [len(one.rows) for one in found] == [1, 2]
    assert by_rule([rows[0], rows[0]])[0].cure == "c0"


# Tests in a browser


@pytest.fixture(scope="module", name="browser")
def browser_fixture() -> Iterator[Any]:
    with browser() as opened:
        yield opened


@pytest.fixture
def opened(browser: Any, page: Path) -> Iterator[Any]:
    with tab_of(browser, page) as tab:
        yield tab


@pytest.mark.slow
def test_tables_are_sorted_by_a_click_and_a_key(opened: Any, whole: dict[str, Any]) -> None:
    def column(number: int) -> list[float]:
        cells = opened.locator(f"table.sorted tbody tr td:nth-child({number})")
        return [float(cell.get_attribute("data-value")) for cell in cells.all()]

    most = [core["compartments"] for core in whole["cores"]]
    button = opened.locator("table.sorted th:nth-child(3) button")
    button.click()
    assert column(3) == sorted(most)
    button.press("Enter")
    assert column(3) == sorted(most, reverse=True)


@pytest.mark.slow
def test_cores_are_shaded_by_the_chosen_measure_and_link_to_their_rows(opened: Any) -> None:
    def darkness() -> list[str]:
        found = "rects => rects.map(rect => getComputedStyle(rect).fillOpacity)"
        return list(opened.locator(".map .core").evaluate_all(found))

    by_fill = darkness()
    opened.get_by_label("energy").first.check()
    by_energy = darkness()
    assert by_energy != by_fill
    assert max(map(float, by_energy)) == pytest.approx(1)
    core = opened.locator(".map a").nth(1)
    core.hover()
    assert "core 1" in core.locator("title").text_content()
    core.focus()
    opened.keyboard.press("Enter")
    assert opened.evaluate("document.querySelector('tr:target').id") == "core-1-1"


@pytest.mark.slow
def test_a_page_is_readable_in_dark_mode_and_on_paper(opened: Any) -> None:
    style = "getComputedStyle(document.body)"
    light = {}
    for scheme, media in (("light", "screen"), ("dark", "screen"), ("light", "print")):
        opened.emulate_media(color_scheme=scheme, media=media)
        pair = opened.evaluate(f"[{style}.color, {style}.backgroundColor]")
        light[scheme, media] = [sum(map(int, re.findall(r"\d+", text)[:3])) for text in pair]
    assert light["light", "screen"][1] - light["light", "screen"][0] > 500
    assert light["dark", "screen"][0] - light["dark", "screen"][1] > 500
    assert light["light", "print"] == [0, 765]


@pytest.mark.slow
def test_a_printed_page_shows_closed_details_and_fits_the_paper(opened: Any) -> None:
    findings = opened.locator("details:not([open]) li").first
    assert not findings.is_visible()
    opened.emulate_media(media="print")
    assert findings.is_visible()
    opened.set_viewport_size({"width": 718, "height": 1000})  # A4 within its margins
    assert opened.evaluate("document.documentElement.scrollWidth") <= 718


@pytest.mark.slow
def test_the_page_is_no_wider_than_the_window(opened: Any) -> None:
    for width in (1000, 400):
        opened.set_viewport_size({"width": width, "height": 800})
        assert opened.evaluate("document.documentElement.scrollWidth") <= width
