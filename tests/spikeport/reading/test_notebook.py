"""Code cells of notebooks, read as data without lines that only IPython can run."""

import json

import pytest

from spikeport.errors import UsageError
from spikeport.reading import notebook
from spikeport.reading.notebook import read_notebook


def written(folder, *sources, **more):
    path = folder / "some.ipynb"
    cells = [{"cell_type": "code", "source": source, "outputs": [{}]} for source in sources]
    content = {"nbformat": 4, "metadata": {}, "cells": cells, **more}
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def code(folder, *sources):
    return [cell.code for cell in read_notebook(written(folder, *sources))]


def refusal(path):
    with pytest.raises(UsageError) as caught:
        read_notebook(path)
    return str(caught.value)


def test_code_cells_are_numbered_among_all_cells(tmp_path):
    text = {"cell_type": "markdown", "source": "# Title"}
    cells = [text, {"cell_type": "code", "source": ["x = 1\n", "y = 2"]}, text]
    assert read_notebook(written(tmp_path, cells=cells)) == [(2, "x = 1\ny = 2\n", ())]


@pytest.mark.parametrize(
    ("source", "left", "skipped"),
    [
        ("%matplotlib inline\nx = 1", "pass\nx = 1\n", ["%matplotlib inline"]),
        ("if x:\n    !ls -l\ny = 1", "if x:\n    pass\ny = 1\n", ["!ls -l"]),
        ("files = !ls\nnengo?\n?nengo", "pass\npass\npass\n", ["files = !ls", "nengo?", "?nengo"]),
        ("!pip install \\\n    nengo\nx = 1", "pass\n\nx = 1\n", ["!pip install \\"]),
        ("%%time\nx = 1", "\nx = 1\n", ["%%time"]),
        ("%%bash\nls -l", "\n", ["%%bash and its cell"]),
        ("\n \n%%bash\nls -l", "\n", ["%%bash and its cell"]),
        ("\n%%time \nx = 1", "\n\nx = 1\n", ["%%time"]),
        ("x = (7\n% 4)", "x = (7\n% 4)\n", []),
        ("t = '''\n%d\n'''\n%magic", "t = '''\n%d\n'''\npass\n", ["%magic"]),
        ("t = 'a\u2028b'\r\n!x \\\r\ny", "t = 'a\u2028b'\npass\n\n", ["!x \\"]),
        ("", "\n", []),
    ],
)
def test_lines_of_ipython_are_left_out(tmp_path, source, left, skipped):
    ((_, found, lines),) = read_notebook(written(tmp_path, source))
    assert (found, list(lines)) == (left, skipped)


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("x = = 1", "invalid syntax (<unknown>, line 1)"),
        ("x = 'a\0'", "source code string cannot contain null bytes"),
        ("(" * 1000, "too many nested parentheses (<unknown>, line 1)"),
    ],
)
def test_a_cell_that_is_not_python_is_named(tmp_path, source, reason):
    path = written(tmp_path, "x = 1", source)
    assert refusal(path) == f"{path}: cell 2 is not Python: {reason}"


def test_a_file_that_is_not_a_python_notebook_or_too_long_is_refused(tmp_path, monkeypatch):
    path = written(tmp_path, "x <- 1", metadata={"language_info": {"name": "R"}})
    assert refusal(path) == f"{path}: a notebook of R, expected Python"
    path = written(tmp_path, nbformat=3)
    assert refusal(path).startswith(f"{path}: not a notebook of nbformat 4:\n  nbformat: ")
    path.write_text("{}", encoding="utf-8")
    assert "\n  cells: is missing" in refusal(path)
    path.write_text("no", encoding="utf-8")
    assert refusal(path).startswith(f"{path}: not JSON: ")
    monkeypatch.setattr(notebook, "CODE_LETTERS", 10)
    path = written(tmp_path, "x = 1\n" * 3)
    assert refusal(path) == f"{path}: more than 10 letters of code; leave cells out"


def test_more_lines_of_ipython_than_the_limit_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(notebook, "MAGICS", 3)
    path = written(tmp_path, "%magic\n" * 4)
    message = f"{path}: cell 1: more than 3 lines of IPython, the limit for this much code"
    assert refusal(path) == f"{message}; leave some out"


def test_the_amount_of_code_that_is_parsed_is_limited(tmp_path, monkeypatch):
    parsed = []
    parse = notebook.ast.parse
    monkeypatch.setattr(
        notebook.ast, "parse", lambda text, *rest: parsed.append(len(text)) or parse(text, *rest)
    )
    monkeypatch.setattr(notebook, "PARSED_LETTERS", 45_000)
    path = written(tmp_path, *["x = 1\n" * 20 + "%magic\n" * 20] * 8)
    assert len(read_notebook(path)) == 8
    path = written(tmp_path, *["x = 1\n" * 20 + "%magic\n" * 20] * 8, "x = 1\n" * 5_000)
    assert "more than 1 lines of IPython" in refusal(path)
    assert sum(parsed) < 2 * notebook.PARSED_LETTERS
