from pathlib import Path

import pytest

from spikeport import documents

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


def test_main_writes_every_document(tmp_path):
    documents.main(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(documents.DOCUMENTS)


def test_a_pair_of_options_has_the_default_that_holds_without_either():
    rows = documents.commands().split("## spikeport simulate\n")[1].split("\n## ")[0].splitlines()
    defaults = {row.split("`")[1]: row.split("`")[-2] for row in rows if "` or `--no-" in row}
    assert defaults == {"--float": "--float", "--overwrite": "--no-overwrite"}
