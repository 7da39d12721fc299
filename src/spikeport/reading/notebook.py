"""Jupyter notebooks: their code cells, as Python that runs without IPython.

A notebook is read as data: nothing of it is run here.
"""

import ast
import re
from pathlib import Path
from typing import Literal, NamedTuple

from pydantic import BaseModel

from spikeport.errors import UsageError, printable
from spikeport.files import read_json, read_model

CODE_LETTERS = 10**6
"""Most letters of all code cells, a hundred times those of a long tutorial."""
MAGICS = 200
"""Most magics in a cell."""
PARSED_LETTERS = 4 * 10**6
"""Most letters that are parsed, in some seconds: each magic in a cell has it parsed again."""
MAGIC = re.compile(r"\s*((?:[\w, ]+=)?\s*[%!]|\?|.*\?\s*$)")
"""A line of IPython: ``%magic``, ``!command``, ``x = !command``, ``?name`` or ``name?``."""
LINE_END = re.compile(r"\r\n?|\n")
"""The end of a line of Python; `str.splitlines` splits elsewhere, too, as within a string."""
PYTHON_INSIDE = ("capture", "prun", "time", "timeit")
"""Magics of a whole cell whose other lines are Python."""
NO_PYTHON = (SyntaxError, ValueError, RecursionError, MemoryError)


class _Language(BaseModel):
    name: str = "python"


class _Metadata(BaseModel):
    language_info: _Language = _Language()


class _Cell(BaseModel):
    cell_type: str
    source: str | list[str] = ""


class _Notebook(BaseModel):
    nbformat: Literal[4]
    metadata: _Metadata = _Metadata()
    cells: list[_Cell]


class Cell(NamedTuple):
    """A code cell: its number among all cells, from 1, its Python, and the lines left out of it."""

    number: int
    code: str
    skipped: tuple[str, ...]


def read_notebook(path: Path) -> list[Cell]:
    """Return the code cells of a notebook; lines of IPython are left out of them.

    Raises
    ------
    UsageError
        If the file cannot be read, or is not a Python notebook in nbformat 4.
    """
    notebook = read_model(path, _Notebook, "notebook of nbformat 4", read=read_json)
    language = notebook.metadata.language_info.name
    if not language.lower().startswith(("python", "ipython")):
        raise UsageError(f"{path}: a notebook of {printable(language)}, expected Python")
    code = {i: "".join(c.source) for i, c in enumerate(notebook.cells, 1) if c.cell_type == "code"}
    letters = sum(map(len, code.values()))
    if letters > CODE_LETTERS:
        raise UsageError(f"{path}: more than {CODE_LETTERS:,} letters of code; leave cells out")
    magics = min(MAGICS, PARSED_LETTERS // max(letters, 1))
    return [_cell(path, number, source, magics) for number, source in code.items()]


def _cell(path: Path, number: int, source: str, magics: int) -> Cell:
    lines, skipped = LINE_END.split(source), list[str]()
    # IPython takes no notice of empty lines at the beginning.
    first = next((row for row, line in enumerate(lines) if line.strip()), 0)
    if (magic := lines[first].strip()).startswith("%%"):
        inside = magic.strip("% \t").partition(" ")[0] in PYTHON_INSIDE
        skipped.append(magic + (" and its cell" * (not inside)))
        lines = [*[""] * (first + 1), *lines[first + 1 :]] if inside else []
    # A line is taken for a magic only where Python cannot parse it: a line that begins with % may
    # continue the line before, or be part of a string.
    while (fault := _fault(lines)) is not None:
        row = (fault.lineno or 0) - 1 if isinstance(fault, SyntaxError) else -1
        magic = 0 <= row < len(lines) and MAGIC.match(lines[row])
        if not magic:
            raise UsageError(f"{path}: cell {number} is not Python: {printable(str(fault))}")
        if len(skipped) == magics:
            most = f"more than {magics} lines of IPython, the limit for this much code"
            raise UsageError(f"{path}: cell {number}: {most}; leave some out")
        skipped.append(_skip(lines, row))
    return Cell(number, "\n".join(lines) + "\n", tuple(skipped))


def _fault(lines: list[str]) -> Exception | None:
    """Return the error that Python finds in some lines, if any."""
    try:
        ast.parse("\n".join(lines))
    except NO_PYTHON as error:
        return error
    return None


def _skip(lines: list[str], row: int) -> str:
    """Replace a line, with its continuation lines, by ``pass``; return the line."""
    line = lines[row]  # no line is removed, so that errors of the cell name the right line
    goes_on = line.endswith("\\")
    lines[row] = line[: len(line) - len(line.lstrip())] + "pass"
    while goes_on and row + 1 < len(lines):
        row += 1
        goes_on, lines[row] = lines[row].endswith("\\"), ""
    return line.strip()
