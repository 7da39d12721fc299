"""The console of the commands prints names as they are."""

import re
from pathlib import Path

import pytest

from spikeport.commands import console as module
from spikeport.commands.console import Console, ScreenTable

NAME = "[red]x[/] :smile: [/bold]"


def table(cell: str = 40 * "-", column: str = "", title: str = "") -> ScreenTable:
    made = ScreenTable(column, title=title)
    made.add_row(cell)
    return made


@pytest.mark.parametrize("printed", [NAME, table(cell=NAME), table(column=NAME), table(title=NAME)])
def test_names_are_printed_as_they_are(printed, capsys):
    Console(width=80).print(printed)
    assert NAME in capsys.readouterr().out


def test_tables_lose_no_letter_on_a_narrow_screen(capsys):
    wide = ScreenTable("name", title="wide")
    wide.add_numbers("used / limit", "%")
    wide.add_row("l" * 50 + "end", "1,023 / 131,072", "99.9")
    Console(width=30).print(wide)
    printed = "".join(capsys.readouterr().out.split())
    assert "…" not in printed
    assert printed.count("l") == 50 + 1  # of the name, and of its header
    assert all(text in printed for text in ("1,023/", "131,072", "99.9"))


def test_numbers_are_aligned_at_their_right_end(capsys):
    made = ScreenTable("name")
    made.add_numbers("used", "%")
    made.add_row("core", "7", "1.5")
    Console(width=40).print(made)
    heading, _, row = filter(None, map(str.rstrip, capsys.readouterr().out.splitlines()))
    assert row.index("7") == heading.index("used") + 3
    assert row.index("1.5") + 2 == heading.index("%")


def test_no_command_uses_another_console_table_or_markup():
    folder = Path(module.__file__).parent
    others = [p for p in folder.glob("*.py") if p.name != "console.py"]
    assert len(others) > 30
    other = r"(?m)rich\.(console|markup|print|table|box)|^\s*(import rich\b|from rich import)"
    assert [p.name for p in others if re.search(f"{other}|from_markup", p.read_text())] == []
