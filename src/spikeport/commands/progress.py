"""The progress of work that may take over two seconds: a bar on a terminal, else lines."""

import contextlib
import sys
import time
from collections.abc import Iterator

from rich.progress import (
    BarColumn,
    SpinnerColumn,
    Task,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as ProgressBar
from rich.text import Text

from spikeport.commands.console import Console
from spikeport.errors import printable
from spikeport.progress import Progress


@contextlib.contextmanager
def progress_bar(moves: bool = True) -> Iterator[Progress]:
    """Yield the function that work calls to report its progress.

    On a terminal a bar has the stage, the share that is done, and the elapsed and remaining time;
    it vanishes when the block ends. Elsewhere, and without ``moves``, each stage is a line with the
    time at which it began. Both go to the error stream.
    """
    if not (moves and Console(file=sys.stderr).is_terminal):
        yield _lines()
        return
    with ProgressBar(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        _TimeLeft(),
        console=Console(file=sys.stderr),
        transient=True,
    ) as bar:
        yield _on(bar)


class _TimeLeft(TimeRemainingColumn):
    """The time that is left, if it is known."""

    def render(self, task: Task) -> Text:
        """Return the column of a task; empty if its share is not known."""
        if task.total is None:
            return Text()
        return Text.assemble(super().render(task), " left")


def _on(bar: ProgressBar) -> Progress:
    task = bar.add_task("starting", total=None)
    done = 0.0

    def update(what: str, share: float | None) -> None:
        nonlocal done
        if share is None or share < done:  # other work, at a speed of its own
            bar.reset(task, total=None if share is None else 1.0)
        done = share or 0.0
        total = None if share is None else 1.0
        bar.update(task, description=printable(what), total=total, completed=done)

    return update


def _lines() -> Progress:
    start = time.monotonic()
    last = ""

    def update(what: str, _share: float | None) -> None:
        nonlocal last
        if what != last:
            line = f"[{time.monotonic() - start:6.1f} s] {printable(what)}"
            print(line, file=sys.stderr, flush=True)
        last = what

    return update
