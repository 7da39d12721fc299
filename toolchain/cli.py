"""The command line.

Exit codes: 0 done, 1 the network does not fit or a run failed, 2 wrong use, 130 interrupted.
"""

import sys
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
import typer.core

from spikeport import __version__
from spikeport.errors import CompileError, DivergedError, RenderError, SpikeportError


class Commands(typer.core.TyperGroup):
    """The commands; one that is interrupted says so, where typer would exit in silence."""

    def invoke(self, ctx: Any) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            fail("interrupted; nothing that was under way is complete", 130)


app = typer.Typer(
    cls=Commands,
    help="Nengo networks on Loihi-style neuromorphic chips, in closed loop with a robot.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
FAILURES = (CompileError, DivergedError, RenderError)
LARGEST_SEED = 2**32 - 1
"""Of NumPy's random states."""

Chip = Annotated[str, typer.Option(help="A chip's name, or the path of its TOML file.")]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="A setting; repeatable.")
]


@app.callback(invoke_without_command=True)
def root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    """Print the version where it is asked for."""
    if version:
        typer.echo(f"spikeport {__version__}")
        raise typer.Exit


@app.command("compile")
def compile_command(
    network: Annotated[
        str, typer.Argument(help="A built-in name, path/to/file.py:function or module:function.")
    ],
    chip: Chip = "loihi",
    settings: Settings = None,
    out: Annotated[Path | None, typer.Option(help="Folder to write image and report to.")] = None,
    json: Annotated[Path | None, typer.Option(help="File to write the report to.")] = None,
) -> None:
    """Compile a network: say whether it fits, and on how many cores."""
    from spikeport.commands.compile import run

    run(network, chip, settings or [], out, json)


@app.command("run")
def run_command(
    experiment: Annotated[str, typer.Argument(help="The experiment, e.g. reach.")],
    backend: Annotated[
        str, typer.Option(help="analytic, reference, native or nengo-loihi; see `backends`.")
    ] = "native",
    chip: Chip = "loihi",
    seed: Annotated[int, typer.Option(help="Seed of the run.", min=0, max=LARGEST_SEED)] = 0,
    seconds: Annotated[float | None, typer.Option(help="Simulated time.")] = None,
    settings: Settings = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the run.")] = None,
    overwrite: Annotated[bool, typer.Option(help="Replace an earlier run in --out.")] = False,
    video: Annotated[bool, typer.Option("--video", help="Write video.mp4 too.")] = False,
) -> None:
    """Run an experiment of the paper in closed loop, and write its folder."""
    from spikeport.commands.run import Request, run

    run(Request(experiment, backend, chip, seed, seconds, settings or [], out, overwrite, video))


@app.command()
def chips() -> None:
    """List the chips, with their limits and where each figure comes from."""
    from spikeport.commands.lists import print_chips

    print_chips()


@app.command()
def backends() -> None:
    """List the backends, and what each needs."""
    from spikeport.commands.lists import print_backends

    print_backends()


@app.command()
def doctor() -> None:
    """Check what is installed, and say how to get what is missing."""
    from spikeport.commands.doctor import run

    raise typer.Exit(run())


def main() -> None:
    """Run the command line; a user's mistake gives a message, never a traceback."""
    try:
        app(prog_name="spikeport")
    except SpikeportError as error:
        fail(str(error), 1 if isinstance(error, FAILURES) else 2)
    except OSError as error:
        reason = error.strerror or ", ".join(map(str, error.args))
        fail(f"{error.filename or 'system'}: {reason}", 1)


def fail(message: str, code: int) -> NoReturn:
    """Print an error and exit."""
    typer.echo(f"error: {message}", err=True)
    sys.exit(code)
