"""The site of docs/, which builds without a warning and loads nothing from other hosts."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    for needed in ("sphinx", "furo", "myst_nb", "jupytext"):
        pytest.importorskip(needed, reason=f"{needed} is absent: pip install -e '.[docs]'")
    out = tmp_path_factory.mktemp("site")
    # Notebooks that are not executed have no kernel, which would name the lexer of their code.
    off = ["-D", "nb_execution_mode=off", "-D", "suppress_warnings=myst-nb.lexer"]
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", *off, DOCS, out]
    built = subprocess.run(command, check=False, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    return out


def test_every_page_is_in_the_contents_and_in_the_site(site: Path) -> None:
    contents = (DOCS / "index.md").read_text(encoding="utf-8")
    pages = [path.relative_to(DOCS) for path in (*DOCS.glob("*.md"), *DOCS.glob("lab/*.md"))]
    for page in set(pages) - {Path("index.md")}:
        assert f"({page})" in contents, f"enter it in docs/index.md: {page}"
        assert (site / page.with_suffix(".html")).is_file()
    assert (site / "examples" / "pole.html").is_file()


def test_pages_load_nothing_from_other_hosts(site: Path) -> None:
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.search(r"""<(?:script|img|iframe)[^>]*src=["']?(?:https?:)?//""", text), page
        assert not re.search(r"""<link[^>]*rel="stylesheet"[^>]*href="(?:https?:)?//""", text), page
    for sheet in site.rglob("*.css"):
        assert not re.search(r"(?:@import|url\()[\s\"']*(?:https?:)?//", sheet.read_text()), sheet


def test_the_page_of_the_api_renders_equations_and_describes_objects(site: Path) -> None:
    page = (site / "api.html").read_text(encoding="utf-8")
    assert page.count("<math ") >= 5
    for name in ("spikeport.Simulator", "spikeport.compile_network", "spikeport.nir.load"):
        assert f'id="{name}"' in page


def test_links_that_work_on_a_code_host_lead_to_pages_and_downloads_of_the_site(site: Path) -> None:
    page = (site / "own-robot.html").read_text(encoding="utf-8")
    assert 'href="examples/pole.html"' in page
    assert re.search(r'href="_downloads/\w+/own_robot.py"', page)
