"""The options of compiles and runs that commands share, one by one and in groups.

This module imports no Nengo: help does not wait for it.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from spikeport.commands.image_file import image_file
from spikeport.constants import LARGEST_SEED


def path_of(text: str) -> Path:
    """Return the path that an option names; an empty text would be the current folder."""
    if not str(text):
        raise typer.BadParameter("the path is empty, as of a shell variable that is not set")
    return Path(text)


def _no_cache(asked: bool) -> bool:
    """Switch the cache off if the user asks for it, in worker processes, too."""
    if asked:
        from spikeport.cache import switch_off

        switch_off()
    return asked


def written(help_text: str) -> Any:
    """Return the option for an output file or folder."""
    return typer.Option(help=help_text, parser=path_of, metavar="PATH")


ChipOption = Annotated[str, typer.Option(help="Name of a chip, or path of its TOML file.")]
PASSES_HELP = "as_written, compact, or a list like name,name{key=value}; see `spikeport passes`."
PassesOption = Annotated[
    str | None,
    typer.Option(
        "--passes",
        "-p",
        metavar="PASSES",
        help=PASSES_HELP,
    ),
]
OffloadOption = Annotated[
    bool,
    typer.Option("--offload", help="Move ensembles that break a rule of the chip to the host."),
]
ImageFile = Annotated[
    Path,
    typer.Argument(
        help="An image.npz that `compile --out` wrote, or its folder.", callback=image_file
    ),
]
SecondsOption = Annotated[
    float | None,
    typer.Option(help="Simulated time, in s; by default as docs/experiments.md says."),
]


def seed_of(what: str) -> Any:
    """Return the option ``--seed`` of a command; ``what`` the seed is for is in its help."""
    return typer.Option(help=f"Seed of {what}.", min=0, max=LARGEST_SEED)


SeedOption = Annotated[int, seed_of("the run")]
SettingsOption = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set an argument of the function that makes the network, or a setting of the "
        "experiment (docs/settings.md); repeatable.",
        default_factory=list,
        show_default=False,
    ),
]


NoCache = Annotated[
    bool,
    typer.Option(
        "--no-cache",
        callback=_no_cache,
        help="Use no results of earlier runs, and keep none; see `spikeport cache`.",
    ),
]
RunFolder = Annotated[Path | None, written("Folder of the run; by default one in runs/.")]
Overwrite = Annotated[bool, typer.Option(help="Replace an earlier run in this folder.")]
CountsOption = Annotated[
    bool,
    typer.Option(
        "--counts", help="Write the counts of spikes and operations of every step and core, too."
    ),
]


@dataclass(frozen=True, kw_only=True)
class Target:
    """The backend and chip that an experiment runs on, and the passes of its compile."""

    backend: Annotated[str, typer.Option(help="Name of a backend; see `spikeport backends`.")] = (
        "native"
    )
    chip: ChipOption = "loihi"
    passes: PassesOption = None


@dataclass(frozen=True, kw_only=True)
class Workers:
    """The workers of a sweep: processes of this machine, or workers of a Dask scheduler."""

    n: Annotated[
        int | None,
        typer.Option(
            "--workers", help="Number of processes; by default one for each processor core.", min=1
        ),
    ] = None
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tls://...",
            help="Address of a Dask scheduler; tcp://... is for trusted networks only.",
        ),
    ] = None

    @property
    def n_processes(self) -> int:
        """The number of processes: as many as asked for, or one for each core we may use."""
        return self.n or len(os.sched_getaffinity(0))


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """The options of a run: seed, time, settings of the experiment, and outputs."""

    seed: SeedOption = 0
    seconds: SecondsOption = None
    settings: SettingsOption
    out: RunFolder = None
    overwrite: Overwrite = False
    video: Annotated[bool, typer.Option("--video", help="Write video.mp4, too.")] = False
    counts: CountsOption = False
    no_cache: NoCache = False
