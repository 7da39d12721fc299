"""A user's code, run as Python and Jupyter would: a file, a notebook or a module."""

import ast
import asyncio
import contextlib
import importlib
import importlib.util
import linecache
import os
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from spikeport.build_timer import FROM_OUTSIDE
from spikeport.errors import NetworkError, SpikeportError, UsageError, in_words, printable
from spikeport.reading.archive import open_file
from spikeport.reading.mismatch import MismatchError
from spikeport.reading.notebook import Cell, read_notebook

FILES = (".py", ".ipynb")
"""The endings of files that hold code."""
RAN: set[str] = set()
"""The names, in `sys.modules`, of the modules that files and notebooks of users made."""
CURE = (
    "; cure: fix the {what}, or put code that only {who} should run under "
    '`if __name__ == "__main__":`'
)
"""The cure for a script or a cell: here its ``__name__`` is that of a module, not ``__main__``."""


def imported(where: str) -> ModuleType:
    """Return the module that a file, a notebook or a dotted name makes.

    Raises
    ------
    UsageError
        If it is not found, cannot be read, or raises an error.
    """
    # Nobody looks at the plots of a model that is only compiled, and a plot window would block.
    os.environ.setdefault("MPLBACKEND", "agg")
    warnings.filterwarnings("ignore", message="FigureCanvasAgg is non-interactive")
    if where.endswith(".ipynb"):
        return _notebook(Path(where))
    return _file(Path(where)) if where.endswith(".py") else _module(where)


@contextlib.contextmanager
def without_arguments(where: str) -> Iterator[None]:
    """Replace our arguments by the name of a user's script, as when python runs it."""
    ours = sys.argv
    sys.argv = [where]
    try:
        yield
    finally:
        sys.argv = ours


def _module(name: str) -> ModuleType:
    sys.path.insert(0, str(Path.cwd()))  # as python -m looks for modules
    with _named(f"module '{name}' cannot be imported"):
        return importlib.import_module(name)


def _file(path: Path) -> ModuleType:
    try:
        open_file(path).close()
    except MismatchError as error:
        raise UsageError(f"{path}: {error}") from None
    spec = importlib.util.spec_from_file_location(f"spikeport_network_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = _neighbour(importlib.util.module_from_spec(spec), path)
    cure = CURE.format(what="script", who="python itself")
    with _named(f"{path}: cannot be imported", cure):
        spec.loader.exec_module(module)
    return module


def _notebook(path: Path) -> ModuleType:
    cells, cure = read_notebook(path), CURE.format(what="cell", who="Jupyter")
    module = _neighbour(ModuleType(f"spikeport_network_{path.stem}"), path)
    vars(module)["display"] = lambda *_objects, **_options: None  # Jupyter's, in every notebook
    for cell in cells:
        for line in cell.skipped:
            note = f"note: {path}: cell {cell.number}: skipped, for it is IPython's: {line}"
            print(printable(note), file=sys.stderr)
        with _named(f"{path}: cell {cell.number} cannot be run", cure):
            code = compile(
                cell.code, _source(path, cell), "exec", ast.PyCF_ALLOW_TOP_LEVEL_AWAIT, True
            )
            if (awaits := eval(code, vars(module))) is not None:
                asyncio.run(awaits)
    return module


def _source(path: Path, cell: Cell) -> str:
    """Return a file name for a cell, under which its lines are found, e.g. in tracebacks."""
    name = f"{path}, cell {cell.number}"
    linecache.cache[name] = len(cell.code), None, cell.code.splitlines(keepends=True), name
    return name


def _neighbour(module: ModuleType, path: Path) -> ModuleType:
    """Register a module, so that it and the files beside it can be imported."""
    sys.path.insert(0, str(path.parent.resolve()))  # as python looks for a script's neighbours
    sys.modules[module.__name__] = module  # where dataclasses look for names in annotations
    RAN.add(module.__name__)
    return module


@contextlib.contextmanager
def _named(what: str, cure: str = "") -> Iterator[None]:
    """Raise UsageError for an error in a block, with the name of its code and a cure."""
    try:
        yield
    except (SpikeportError, *FROM_OUTSIDE):
        raise
    except BaseException as error:
        # SystemExit as well: scripts may end themselves when they are run.
        raise UsageError(f"{what}: {in_words(error)}{cure}") from error


@contextlib.contextmanager
def contained(spec: str) -> Iterator[None]:
    """Raise NetworkError if a network's code ends the process that compiles or runs it.

    The block calls functions of nodes and connections: a function that calls ``sys.exit(0)`` must
    not look like success.

    Raises
    ------
    NetworkError
        If the code ends the process, raises something other than an `Exception`, or turns warnings
        into errors.
    """
    try:
        yield
    except Warning as warning:
        raise NetworkError(f"{spec}: its code makes an error of a warning: {warning}") from warning
    except (Exception, *FROM_OUTSIDE):
        raise
    except BaseException as error:
        raise NetworkError(f"{spec}: its code raised {in_words(error)}") from error
