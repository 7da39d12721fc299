"""A progress bar for what may take longer than two seconds."""

import contextlib
import sys
from collections.abc import Iterator

from rich.console import Console
from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as ProgressBar

from spikeport.progress import Progress


@contextlib.contextmanager
def progress_bar() -> Iterator[Progress]:
    """Yield the function that work calls to say how far it is.

    The bar is drawn on the error stream, and vanishes when the block ends.
    """
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    console = Console(file=sys.stderr)
    quiet = not console.is_terminal
    with ProgressBar(*columns, console=console, transient=True, disable=quiet) as bar:
        task = bar.add_task("starting", total=None)

        def update(what: str, share: float | None) -> None:
            total = None if share is None else 1.0
            bar.update(task, description=what, total=total, completed=share or 0.0)

        yield update
