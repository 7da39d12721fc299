"""The console of the commands prints names as they are."""

import re
from pathlib import Path

import pytest
from rich.table import Table

from spikeport.commands import console as module
from spikeport.commands.console import Console

NAME = "[red]x[/] :smile: [/bold]"


def table(cell: str = 40 * "-", column: str = "", title: str = "") -> Table:
    made = Table(column, title=title)
    made.add_row(cell)
    return made


@pytest.mark.parametrize("printed", [NAME, table(cell=NAME), table(column=NAME), table(title=NAME)])
def test_names_are_printed_as_they_are(printed, capsys):
    Console(width=80).print(printed)
    assert NAME in capsys.readouterr().out


def test_no_command_uses_another_console_or_markup():
    folder = Path(module.__file__).parent
    others = [p for p in folder.glob("*.py") if p.name != "console.py"]
    assert len(others) > 30
    other = r"(?m)rich\.(console|markup|print)|^\s*(import rich\b|from rich import)|from_markup"
    assert [p.name for p in others if re.search(other, p.read_text())] == []
