"""The console that commands print on."""

from typing import Any

import rich.console


class Console(rich.console.Console):
    """A console that prints names as they are: ``[red]`` and ``:smile:`` mean nothing to it."""

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)
