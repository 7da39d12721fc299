"""The commands of boards and robots, which serve, check and inspect them."""

from pathlib import Path
from typing import Annotated

import typer

from spikeport.commands.option_groups import with_options
from spikeport.commands.options import ImageFile, SeedOption, written
from spikeport.commands.options_of_links import (
    BoardService,
    DomainOption,
    InterfaceOption,
    RobotService,
    Tls,
)

board_app = typer.Typer(
    help="Serve, check, write and inspect boards, which run images at the other end of a link."
)
robot_app = typer.Typer(
    help="Serve a simulated robot behind Unitree's interface, or listen to a robot."
)


@board_app.command("serve")
@with_options
def board_serve_command(service: BoardService, tls: Tls) -> None:
    """Serve a board: receive images from a host and step them."""
    from spikeport.commands.board import serve

    serve(service, tls)


@board_app.command("check")
def board_check_command(
    image: ImageFile,
    *,
    steps: Annotated[
        int, typer.Option(help="Number of steps to compare.", min=1, max=1_000_000)
    ] = 200,
    seed: SeedOption = 0,
) -> None:
    """Check the registers of a real chip against the image; exit with 1 if they differ."""
    from spikeport.commands.board_check import run

    raise typer.Exit(run(image, n_steps=steps, seed=seed))


@board_app.command("write")
def board_write_command(
    image: ImageFile,
    *,
    out: Annotated[Path, written("Folder to write into.")],
    chip: Annotated[
        str | None,
        typer.Option(
            help="A chip with soft cores, or its TOML file; by default the image's own if it "
            "has soft cores, else softcore-ecp5-85f."
        ),
    ] = None,
) -> None:
    """Write the files that build and load an FPGA with soft cores; see docs/softcore.md."""
    from spikeport.commands.board_write import run

    run(image, out, chip=chip)


@board_app.command("inspect")
def board_inspect_command(
    record: Annotated[Path, typer.Argument(help="A file that `--record` of a run wrote.")],
) -> None:
    """Print the content of a recorded session; exit with 1 if it is cut or damaged."""
    from spikeport.commands.board import inspect

    raise typer.Exit(inspect(record))


@robot_app.command("serve")
@with_options
def robot_serve_command(service: RobotService) -> None:
    """Serve a simulated H1 behind Unitree's DDS interface."""
    from spikeport.commands.robot import serve

    serve(service)


@robot_app.command("listen")
def robot_listen_command(
    *,
    interface: InterfaceOption = "lo",
    domain: DomainOption = 1,
    seconds: Annotated[float, typer.Option(help="Time to listen, in s.", min=0.1, max=3600)] = 3.0,
) -> None:
    """Print what a robot publishes, sending nothing; exit with 1 if controllers would refuse it."""
    from spikeport.commands.robot import listen

    listen(interface, domain, seconds)
