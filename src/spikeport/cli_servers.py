"""The commands of boards and robots: processes that serve, and what they leave behind."""

from pathlib import Path
from typing import Annotated

import typer

from spikeport.commands.options import (
    BoardService,
    DomainOption,
    ImageFile,
    InterfaceOption,
    RobotService,
    SeedOption,
    Tls,
    with_options,
)

board_app = typer.Typer(help="Boards at the end of a link, and records of them.")
robot_app = typer.Typer(help="Robots behind Unitree's interface.")


@board_app.command("serve")
@with_options
def board_serve_command(service: BoardService, tls: Tls) -> None:
    """Be a board: take images from a host and step them, until ended."""
    from spikeport.commands.board import serve

    serve(service, tls)


@board_app.command("check")
def board_check_command(
    image: ImageFile,
    *,
    steps: Annotated[int, typer.Option(help="Steps to compare.", min=1, max=1_000_000)] = 200,
    seed: SeedOption = 0,
) -> None:
    """Compare what would be written to a real chip with the image; exit with 1 if it differs."""
    from spikeport.commands.board_check import run

    raise typer.Exit(run(image, n_steps=steps, seed=seed))


@board_app.command("inspect")
def board_inspect_command(
    record: Annotated[Path, typer.Argument(help="A file that `run --record` wrote.")],
) -> None:
    """Print what a record of a board's session holds."""
    from spikeport.commands.board import inspect

    inspect(record)


@robot_app.command("serve")
@with_options
def robot_serve_command(service: RobotService) -> None:
    """Be an H1 in simulation that speaks Unitree's DDS interface, until ended."""
    from spikeport.commands.robot import serve

    serve(service)


@robot_app.command("listen")
def robot_listen_command(
    *,
    interface: InterfaceOption = "lo",
    domain: DomainOption = 1,
    seconds: Annotated[float, typer.Option(help="Time to listen.", min=0.1, max=3600)] = 3.0,
) -> None:
    """Print what a robot publishes, and send it nothing; exit with 1 if it is not to be trusted."""
    from spikeport.commands.robot import listen

    listen(interface, domain, seconds)
