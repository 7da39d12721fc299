"""The commands on a user's own networks and policies, and on their images, reports and runs."""

from pathlib import Path
from typing import Annotated

import typer

from spikeport.commands.option_groups import with_options
from spikeport.commands.options import ImageFile, NoCache, SeedOption, written
from spikeport.commands.options_of_links import Link, Tls
from spikeport.commands.options_of_networks import CompileRequest, ConvertRequest, SimulateRequest

networks_app = typer.Typer()


def explained(rule: str | None) -> None:
    """Print the explanation of a rule, and stop."""
    if rule is not None:
        from spikeport.commands.explain import explain

        explain(rule)
        raise typer.Exit


@networks_app.command("compile")
@with_options
def compile_command(
    request: CompileRequest,
    no_cache: NoCache = False,
    explain: Annotated[
        str | None,
        typer.Option(
            metavar="RULE", help="Explain a rule, e.g. SP101.", callback=explained, is_eager=True
        ),
    ] = None,
) -> None:
    """Compile a network, and print whether it fits, its costs and its losses."""
    from spikeport.commands.compile import run

    run(request)


@networks_app.command("simulate")
@with_options
def simulate_command(request: SimulateRequest, link: Link, tls: Tls) -> None:
    """Simulate a network on a chip, and compare every probe with ordinary Nengo."""
    from spikeport.commands.links import link_options
    from spikeport.commands.simulate import simulate

    simulate(request, link_options(link, tls, request.backend))


@networks_app.command("show")
def show_command(
    image: ImageFile,
) -> None:
    """Print what is in a chip image: chip, digest, blocks, cores, inputs and outputs."""
    from spikeport.commands.show import run

    run(image)


@networks_app.command("view")
def view_command(
    folder: Annotated[Path, typer.Argument(help="The folder of a run.")],
    out: Annotated[
        Path | None, written("Write the page to this file; by default view.html in the folder.")
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Follow a run that is still going on.")
    ] = False,
) -> None:
    """Make a web page that replays a run: robot, spikes, gates and errors."""
    from spikeport.commands.view import run

    run(folder, out, live)


@networks_app.command("step")
def step_command(
    image: ImageFile,
    steps: Annotated[int, typer.Option(help="Number of steps.", min=1, max=10**9)],
    out: Annotated[Path, written("Write outputs and activity to this npz file.")],
    spikes: Annotated[
        Path | None,
        typer.Option(
            help="Read spikes from this npz file: in step steps[i], counted from 0, source "
            "sources[i] spikes; see docs/image.md."
        ),
    ] = None,
    seed: SeedOption = 0,
) -> None:
    """Step a chip image on the native backend, without its network."""
    from spikeport.commands.step import run

    run(image, spikes=spikes, n_steps=steps, out=out, seed=seed)


@networks_app.command("export")
def export_command(
    image: ImageFile,
    nir: Annotated[Path, written("Write a NIR graph to this file.")],
) -> None:
    """Export a chip image as a NIR graph, in the chip's integers."""
    from spikeport.commands.export import run

    run(image, nir)


@networks_app.command("convert")
@with_options
def convert_command(request: ConvertRequest) -> None:
    """Convert a perceptron into a spiking network, and print the error of each layer."""
    from spikeport.commands.convert import run

    run(request)


@networks_app.command("diff")
def diff_command(
    a: Annotated[
        Path, typer.Argument(help="A report, or the folder of a compile, run or evaluation.")
    ],
    b: Annotated[Path, typer.Argument(help="The report or folder to compare with.")],
    html: Annotated[
        Path | None, written("Write the comparison to this file, as a web page.")
    ] = None,
) -> None:
    """Compare the figures of two compiles or runs on a chip, or of two evaluations.

    Exit with 1 if a figure, setting, seed or version differs; a figure of an evaluation, if it does
    by more than chance.
    """
    from spikeport.commands.diff import run

    raise typer.Exit(run(a, b, html))
