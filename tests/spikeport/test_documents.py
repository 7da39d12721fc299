from pathlib import Path

import pytest

from spikeport import documents

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("name", documents.DOCUMENTS)
def test_documents_are_up_to_date(name):
    cure = "write them again with: python -m spikeport.documents docs"
    assert (DOCS / name).read_text(encoding="utf-8") == documents.DOCUMENTS[name](), cure


def test_main_writes_every_document(tmp_path):
    documents.main(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(documents.DOCUMENTS)
