import re
from pathlib import Path

import pytest

from spikeport import documents
from spikeport.backends.registry import BACKENDS

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("name", documents.DOCUMENTS)
def test_documents_are_up_to_date(name):
    cure = "write them again with: python -m spikeport.documents docs"
    assert (DOCS / name).read_text(encoding="utf-8") == documents.DOCUMENTS[name](), cure


def test_required_options_are_marked_in_the_page_of_commands(spikeport):
    section = documents.commands().split("## spikeport step\n")[1].split("\n## ")[0]
    required = [
        line.split("`")[1] for line in section.splitlines() if line.endswith("| required |")
    ]
    assert required == ["--steps", "--out"]
    for name in required:
        others = [part for other in required if other != name for part in (other, 1)]
        done = spikeport("step", "image", *others)
        assert done.code == 2
        assert f"Missing option '{name}'" in done.err


def test_help_of_simulate_names_the_backends_that_it_takes(spikeport):
    section = documents.commands().split("## spikeport simulate\n")[1].split("\n## ")[0]
    (row,) = (line for line in section.splitlines() if line.startswith("| `--backend`"))
    named = set(re.findall(r"[\w-]+", row.split("|")[2].partition(";")[0])) - {"or"}
    assert named == set(BACKENDS)
    done = spikeport("simulate", "model.py", "--backend", "analytic")
    assert done.code == 2
    assert named <= set(re.findall(r"[\w-]+", done.err.partition("choose from:")[2]))


def test_page_of_commands_has_the_exit_codes_that_commands_end_with(spikeport, tmp_path):
    meanings = dict(re.findall(r"^\| (\d) \| (.*) \|$", documents.commands(), re.MULTILINE))
    broken = tmp_path / "broken.py"
    broken.write_text("import no_such_module\n", encoding="utf-8")
    raising = tmp_path / "raising.py"
    raising.write_text("def make():\n    raise ValueError\n", encoding="utf-8")
    assert spikeport("compile", str(tmp_path / "absent.py")).code == 2
    assert spikeport("compile", str(broken)).code == 2
    assert "a file is absent, cannot be imported or is refused" in meanings["2"]
    assert spikeport("compile", f"{raising}:make").code == 1
    assert "a function of yours raised an error" in meanings["1"]


def test_main_writes_every_document(tmp_path):
    documents.main(tmp_path)
    written = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    assert written == {name: make() for name, make in documents.DOCUMENTS.items()}


def test_a_pair_of_options_has_the_default_that_holds_without_either():
    rows = documents.commands().split("## spikeport simulate\n")[1].split("\n## ")[0].splitlines()
    defaults = {row.split("`")[1]: row.split("`")[-2] for row in rows if "` or `--no-" in row}
    assert defaults == {"--float": "--float", "--overwrite": "--no-overwrite"}
