from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from spikeport.commands.option_groups import given, with_options


@dataclass(frozen=True, kw_only=True)
class Size:
    """A group of options: a size and a name."""

    width: Annotated[int, typer.Option()]
    height: Annotated[int, typer.Option("--height", "-h")] = 2


@dataclass(frozen=True, kw_only=True)
class Wall:
    """A group with an argument, a group of its own, and a value that is no option."""

    name: Annotated[str, typer.Argument()]
    size: Size
    bare: bool = True


@pytest.fixture
def asked():
    """Return the values of a command's call, and the command line that calls it."""
    values = []
    app = typer.Typer()

    @app.command()
    @with_options
    def paint(what: str, *, colour: str = "red", size: Size) -> None:
        values.append((what, colour, size))

    return values, lambda *arguments: CliRunner().invoke(app, arguments)


def test_the_fields_of_a_group_are_options_of_the_command(asked):
    values, call = asked
    assert call("wall", "--width", "3", "-h", "4").exit_code == 0
    assert call("door", "--width", "1", "--colour", "blue").exit_code == 0
    assert values == [
        ("wall", "red", Size(width=3, height=4)),
        ("door", "blue", Size(width=1, height=2)),
    ]


def test_a_field_without_a_default_must_be_given(asked):
    values, call = asked
    done = call("wall")
    assert done.exit_code == 2
    assert "Missing option '--width'" in done.output
    assert values == []


def test_a_group_may_hold_arguments_another_group_and_values_that_are_no_options():
    walls, app = [], typer.Typer()

    @app.command()
    @with_options
    def build(wall: Wall) -> None:
        walls.append(wall)

    assert CliRunner().invoke(app, ["north", "--width", "3"]).exit_code == 0
    assert walls == [Wall(name="north", size=Size(width=3))]
    assert "bare" not in CliRunner().invoke(app, ["--help"]).output


def test_the_options_that_differ_from_their_defaults_are_named():
    assert given(Size(width=3)) == "--width"
