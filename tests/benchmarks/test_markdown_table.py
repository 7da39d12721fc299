"""Tables in documents."""

import argparse

import pytest
from markdown_table import BEGIN, END, document, show


def test_a_table_is_printed_and_written(tmp_path, capsys):
    path = tmp_path / "walk.md"
    path.write_text(f"{BEGIN}\nold\n{END}\n")
    show("new", document(str(path)))
    assert path.read_text() == f"{BEGIN}\nnew\n{END}\n"
    assert capsys.readouterr().out == "new\n"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "text", ["", BEGIN, END, f"{END}{BEGIN}", f"{BEGIN}{END}{BEGIN}{END}", f"{BEGIN}{END}{END}"]
)
def test_a_file_without_one_pair_of_markers_is_refused(tmp_path, text):
    path = tmp_path / "walk.md"
    path.write_text(text)
    with pytest.raises(argparse.ArgumentTypeError, match="has not one <!-- benchmark -->"):
        document(str(path))


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(argparse.ArgumentTypeError, match="No such file"):
        document(str(tmp_path / "walk.md"))
