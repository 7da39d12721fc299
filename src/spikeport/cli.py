"""The command line.

Exit codes: 0 done, 1 the network does not fit, a run failed or a user's function raised, 2 wrong
use or a file that is refused or cannot be imported, 130 interrupted, 128 + n ended by signal n. The
class of an error decides between 1 and 2: `SpikeportError.exit_code`.
"""

import os
import sys
import warnings
from typing import Annotated, Any, NoReturn, TextIO

import typer
import typer.core

from spikeport import __version__
from spikeport.cli_experiments import experiments_app
from spikeport.cli_networks import networks_app
from spikeport.cli_servers import board_app, robot_app
from spikeport.commands import process
from spikeport.errors import SpikeportError, printable


class CommandGroup(typer.core.TyperGroup):
    """The group of commands. It reports an interrupt, where typer would exit in silence."""

    def invoke(self, ctx: Any) -> object:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as interrupt:
            fail_interrupted(str(interrupt))
        except RuntimeError as error:
            # Python makes one of an interrupt in the making of a class, as within an import.
            if isinstance(error.__cause__, KeyboardInterrupt):
                fail_interrupted()
            raise


app = typer.Typer(
    cls=CommandGroup,
    help="Put Nengo networks on neuromorphic chips like Loihi, in closed loop with a robot.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


@app.callback(invoke_without_command=True)
def root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    """Print the version if `--version` asks for it."""
    if version:
        typer.echo(f"spikeport {__version__}")
        raise typer.Exit


# in the order of the help
app.registered_commands += networks_app.registered_commands + experiments_app.registered_commands


@app.command("cache")
def cache_command(
    clear: Annotated[bool, typer.Option("--clear", help="Remove all cached results.")] = False,
) -> None:
    """List the results that are cached for later runs, such as compiles, calibrations and gaits."""
    from spikeport.commands.cache import run

    run(clear)


app.add_typer(board_app, name="board", no_args_is_help=True)
app.add_typer(robot_app, name="robot", no_args_is_help=True)


@app.command()
def chips() -> None:
    """List the chips, with the source of every figure."""
    from spikeport.commands.lists import print_chips

    print_chips()


@app.command()
def passes() -> None:
    """List the passes of the compiler, with their options."""
    from spikeport.commands.passes import print_passes

    print_passes()


@app.command()
def backends() -> None:
    """List the backends, what each is, and which experiments can use it."""
    from spikeport.commands.lists import print_backends

    print_backends()


@app.command()
def doctor() -> None:
    """List what is installed, and how to install what is missing."""
    from spikeport.commands.doctor import run

    raise typer.Exit(run())


def main() -> None:
    """Run the command line; a user's mistake gives a message, never a traceback."""
    warnings.filterwarnings("ignore", module="spikeport.compile")  # the report has them
    warnings.showwarning = warn
    process.prepare()
    try:
        process.check_environment()
        try:
            app(prog_name="spikeport")
        finally:
            _flush()
    except SpikeportError as error:
        fail(str(error), error.exit_code)
    except OSError as error:
        reason = error.strerror or ", ".join(map(str, error.args))
        fail(f"{error.filename or 'system'}: {reason}", 1)
    except KeyboardInterrupt:  # before a command begins: `CommandGroup` has the others
        fail_interrupted()


def _flush() -> None:
    """Flush standard output, so that a full disk is an error; at exit, Python would only warn."""
    try:
        sys.stdout.flush()
    except OSError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 (the old one keeps the unwritten text)
        raise


def warn(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Print a warning without the line of code that it comes from."""
    text = printable(str(message), kept="\n")
    typer.echo(f"warning: {text}", err=True)


def fail_interrupted(left: str = "") -> NoReturn:
    """Print that Ctrl-C ended a command, and the results that are ``left`` by it, and exit."""
    fail(f"interrupted; {left or 'no result was completed'}", 130)


def fail(message: str, code: int) -> NoReturn:
    """Print an error with its control characters escaped, and exit."""
    text = printable(message, kept="\n")
    typer.echo(f"error: {text}", err=True)
    sys.exit(code)
