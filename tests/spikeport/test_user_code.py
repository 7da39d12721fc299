"""Users' files, notebooks and modules, run as Python and Jupyter would, and their errors."""

import inspect
import json
import os

import pytest

from spikeport.errors import UsageError
from spikeport.user_code import imported


def refusal(where):
    with pytest.raises(UsageError) as caught:
        imported(str(where))
    return str(caught.value)


def notebook(folder, *sources, **more):
    cells = [{"cell_type": "code", "source": source} for source in sources]
    path = folder / "some.ipynb"
    path.write_text(json.dumps({"nbformat": 4, "cells": cells, **more}), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("import no_such_package", "ModuleNotFoundError: No module named 'no_such_package'"),
        ("raise SystemExit(0)", "SystemExit: 0"),
    ],
)
def test_the_refusal_of_a_file_or_cell_that_raises_names_error_and_line(tmp_path, text, reason):
    path = tmp_path / "broken.py"
    path.write_text(text, encoding="utf-8")
    assert refusal(path) == (
        f"{path}: cannot be imported: {reason} ({path}, line 1); cure: fix the script, or put code "
        'that only python itself should run under `if __name__ == "__main__":`'
    )
    path.write_text(f'if __name__ == "__main__":\n    {text}', encoding="utf-8")
    assert imported(str(path))
    path = notebook(tmp_path, "x = 1", text)
    assert refusal(path) == (
        f"{path}: cell 2 cannot be run: {reason} ({path}, cell 2, line 1); cure: fix the cell, or "
        'put code that only Jupyter should run under `if __name__ == "__main__":`'
    )
    assert imported(str(notebook(tmp_path, f'if __name__ == "__main__":\n    {text}')))


def test_a_file_that_is_not_python_is_refused_with_its_path(tmp_path):
    path = tmp_path / "broken.py"
    path.write_text("def make(:\n", encoding="utf-8")
    assert refusal(path).startswith(f"{path}: cannot be imported: SyntaxError: ")


def test_a_missing_file_or_module_is_named(tmp_path):
    for name in ("no.py", "no.ipynb"):
        assert refusal(tmp_path / name) == f"{tmp_path / name}: no such file"
    (folder := tmp_path / "folder.py").mkdir()
    assert refusal(folder) == f"{folder}: cannot be read: Is a directory"
    long = tmp_path / f"{'n' * 300}.py"
    assert refusal(long) == f"{long}: cannot be read: File name too long"
    assert refusal("no_such_module") == (
        "module 'no_such_module' cannot be imported: "
        "ModuleNotFoundError: No module named 'no_such_module'"
    )
    assert refusal(".net").startswith("module '.net' cannot be imported: TypeError: ")


def test_a_device_is_refused(tmp_path):
    """The test has a device, since it would wait for a pipe that is not refused."""
    (path := tmp_path / "null.py").symlink_to(os.devnull)
    assert refusal(path).startswith(f"{path}: expected a file")


def test_cells_of_a_notebook_run_one_after_the_other(tmp_path, capsys):
    (tmp_path / "beside.py").write_text("number = 4\n", encoding="utf-8")
    path = notebook(
        tmp_path,
        "%matplotlib inline\nimport beside",
        ["def make():\n", "    return beside.number"],
        "%%time\nmade = make()\ndisplay(made)",
    )
    module = imported(str(path))
    assert module.made == 4
    assert inspect.getsource(module.make) == "def make():\n    return beside.number\n"
    assert capsys.readouterr().err == (
        f"note: {path}: cell 1: skipped, for it is IPython's: %matplotlib inline\n"
        f"note: {path}: cell 3: skipped, for it is IPython's: %%time\n"
    )


def test_cells_may_await_as_in_jupyter(tmp_path):
    path = notebook(tmp_path, "import asyncio\nmade = await asyncio.sleep(0, 4)")
    assert imported(str(path)).made == 4


def test_plots_open_no_window(tmp_path, monkeypatch):
    monkeypatch.delenv("MPLBACKEND", raising=False)
    path = tmp_path / "plots.py"
    path.write_text("import os\nbackend = os.environ['MPLBACKEND']\n", encoding="utf-8")
    assert imported(str(path)).backend == "agg"
