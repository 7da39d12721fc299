"""The console that commands print on, and the tables that they print."""

from typing import Any

import rich.console
import rich.table
from rich.box import SIMPLE_HEAD


class Console(rich.console.Console):
    """A console that prints names as they are: ``[red]`` and ``:smile:`` mean nothing to it."""

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)


def line_console(**options: Any) -> Console:
    """Return a console for whole lines: a terminal breaks them, and a file has them unbroken."""
    return Console(soft_wrap=True, highlight=False, **options)


class ScreenTable(rich.table.Table):
    """A table that breaks texts into lines where it is too wide for the screen, and cuts none off.

    A file and a pipe are as wide as the variable ``COLUMNS`` says, or 80 letters.
    """

    def __init__(self, *headers: str, **options: Any) -> None:
        super().__init__(*headers, **{"box": SIMPLE_HEAD, **options})

    def add_column(self, *header: Any, **options: Any) -> None:
        """Add a column; options are those of rich."""
        super().add_column(*header, overflow="fold", **options)

    def add_numbers(self, *headers: str) -> None:
        """Add columns of numbers, aligned at their right end."""
        for header in headers:
            self.add_column(header, justify="right")
