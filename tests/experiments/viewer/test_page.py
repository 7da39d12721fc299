"""The page of a run: no requests, its poses, and controls that play, scrub, turn and save."""

import base64
import json
import re

import numpy as np
import pytest
from PIL import Image

from spikeport.experiments.viewer.page import _frames, write_page
from spikeport.experiments.viewer.rows import rows
from tests.helpers.browsers import browser, tab_of


@pytest.fixture
def page(series, tmp_path):
    write_page(tmp_path / "view.html", series, "switch: runs/<b>one</b>")
    return tmp_path / "view.html"


def data_of(page):
    """Return the data in a page."""
    (data,) = re.findall(
        r'<script type="application/json" id="data">(.*?)</script>', page.read_text()
    )
    return json.loads(data)


def test_a_page_makes_no_requests_and_escapes_the_texts_of_a_run(page):
    text = page.read_text()
    assert not re.search(r"https?://|@import|url\(", text)
    assert "default-src 'none'" in text
    assert "<b>" not in text
    assert text.count("</script>") == 2


@pytest.mark.parametrize("step_s", [0.001, 0.005, 0.008])
def test_a_page_has_25_poses_a_second_for_steps_of_any_length(step_s):
    times_s = step_s * np.arange(1 + round(2 / step_s))
    shown = times_s[_frames(times_s)]
    assert shown[0] == 0.0
    np.testing.assert_allclose(np.diff(shown), 0.04, atol=step_s)
    assert len(shown) == 51


def test_a_held_state_and_uneven_steps_do_not_change_the_rate_of_poses():
    """In real time, times are those of a robot's states, and the first may be held."""
    times_s = np.array([0.0, 0.0, 0.006, 0.01, *np.arange(0.015, 1.0, 0.005)])
    shown = times_s[_frames(times_s)]
    assert len(shown) == 25
    assert _frames(np.array([0.5])).tolist() == [0]
    assert _frames(np.zeros(0)).tolist() == []


def test_the_page_of_a_run_without_a_robot_has_its_rows_alone(series, tmp_path):
    write_page(tmp_path / "view.html", series, "robot")
    write_page(tmp_path / "net.html", series.drop_vars("qpos"), "net")
    whole, rows_alone = data_of(tmp_path / "view.html"), data_of(tmp_path / "net.html")
    assert whole.keys() - rows_alone.keys() == {"robot"}
    assert [row["name"] for row in rows_alone["rows"]] == [row.name for row in rows(series)]
    assert whole.items() >= rows_alone.items()


def test_a_robot_keeps_its_shape_however_far_it_walks(series, tmp_path):
    walked = series.copy(deep=True)
    walked.qpos.values[:, 2] = walked.qpos.values[0, 2]
    walked.qpos.values[:, 0] += np.linspace(0, 100, 200)
    write_page(tmp_path / "view.html", walked, "walk")
    robot = data_of(tmp_path / "view.html")["robot"]
    places, ends = (
        np.frombuffer(base64.b64decode(robot[key]), kind).reshape(25, -1)
        for key, kind in (("places", "<f4"), ("ends", "<i2"))
    )
    np.testing.assert_allclose(
        places[:, 0] - places[0, 0], np.linspace(0, 192, 25) * 1e5 / 199, atol=1
    )
    assert np.abs(ends - ends[0]).max() <= 1
    assert np.abs(ends).max() < 2000


def test_a_robot_that_climbs_beyond_32_m_stays_above_the_floor(series, tmp_path):
    climbed = series.copy(deep=True)
    climbed.qpos.values[:, 2] += np.linspace(0, 100, 200)
    write_page(tmp_path / "view.html", climbed, "walk")
    ends = data_of(tmp_path / "view.html")["robot"]["ends"]
    heights = np.frombuffer(base64.b64decode(ends), "<i2").reshape(25, -1, 3)[..., 2]
    assert (heights[-1] == 2**15 - 1).all()


@pytest.mark.slow
def test_the_page_of_a_run_without_a_robot_shows_none(series, tmp_path):
    write_page(tmp_path / "view.html", series.drop_vars("qpos"), "net")
    with browser() as opened, tab_of(opened, tmp_path / "view.html") as tab:
        assert not tab.locator("#robot").is_visible()


@pytest.mark.slow
def test_a_page_plays_scrubs_turns_the_robot_and_saves_a_picture(page, tmp_path):
    with browser() as opened, tab_of(opened, page) as tab:

        def picture():
            return tab.evaluate("document.getElementById('robot').toDataURL()")

        assert tab.locator("#time").text_content() == "0.000 of 1.000 s"
        assert tab.locator("figcaption").first.text_content() == "error of the hand (m)"
        low = picture()
        box = tab.locator("figure canvas").nth(1).bounding_box()
        tab.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + 20)
        assert tab.evaluate("now") == pytest.approx(0.75, abs=0.01)
        high = picture()
        assert high != low
        tab.locator("#robot").hover()
        tab.mouse.down()
        tab.mouse.move(200, 300)
        tab.mouse.up()
        assert picture() != high
        tab.locator("#at").press("Home")
        assert tab.evaluate("now") == 0
        tab.locator("#speed").select_option("4")
        tab.locator("#play").click()
        tab.locator("#play[aria-pressed=false]").wait_for()
        assert tab.evaluate("now === run.end_s")
        assert tab.locator("#play").text_content() == "play"
        with tab.expect_download() as saving:
            tab.locator("#save").click()
        saving.value.save_as(tmp_path / "saved.png")
    with Image.open(tmp_path / "saved.png") as saved:
        assert saved.width > 500
        assert len(saved.convert("RGB").getcolors(2**20)) > 20
