"""The options of commands on a user's own network or policy, as requests.

This module imports no Nengo: help does not wait for it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from spikeport.commands.destinations import Destinations
from spikeport.commands.options import (
    PASSES_HELP,
    ChipOption,
    CountsOption,
    OffloadOption,
    Overwrite,
    PassesOption,
    RunFolder,
    SeedOption,
    SettingsOption,
    Target,
    seed_of,
)

if TYPE_CHECKING:
    from spikeport.compile.report.budget import Budget

MODEL = (
    "FILE.py or FILE.ipynb, with a network called `model` or `net`, or with a single network or "
    "function that makes one; FILE.py:NAME, FILE.ipynb:NAME or module:NAME of a network, or of a "
    "function that makes one; or graph.nir."
)
BuildTimeout = Annotated[
    float | None,
    typer.Option(
        "--build-timeout",
        metavar="SECONDS",
        min=0.001,
        max=10**6,
        help="Give up if your code takes longer to make the network; the compile has no limit.",
    ),
]
GraphStep = Annotated[
    float | None,
    typer.Option(
        "--dt", metavar="SECONDS", help="Time step of a NIR graph, which needs one, in s."
    ),
]


@dataclass(frozen=True, kw_only=True)
class Limits:
    """The limits of a budget."""

    max_cores: Annotated[
        int | None, typer.Option(help="Exit with 1 if the network takes more cores.")
    ] = None
    max_power_w: Annotated[
        float | None,
        typer.Option(
            "--max-power",
            metavar="W",
            help="Exit with 1 if the network takes more power; needs --rate-hz or --loss.",
        ),
    ] = None
    max_step_us: Annotated[
        float | None,
        typer.Option(
            metavar="US",
            help="Exit with 1 if a step takes longer, in us; needs --rate-hz or --loss.",
        ),
    ] = None

    def budget(self) -> "Budget":
        """Return the budget; UsageError if a limit is not a positive number."""
        from spikeport.compile.report.budget import Budget

        return Budget(self.max_cores, self.max_power_w, self.max_step_us)


@dataclass(frozen=True, kw_only=True)
class CompileRequest:
    """A compile of a network, as the user asked for it."""

    network: Annotated[
        str, typer.Argument(metavar="MODEL", help=f"{MODEL} Or built in: arm, walk, humanoid.")
    ]
    chip: ChipOption = "loihi"
    settings: SettingsOption
    dt_s: GraphStep = None
    spikes: Annotated[
        str | None,
        typer.Option(
            metavar="FILE.npz",
            help="Input spikes, or `random`, to compare a NIR graph with NIR's equations.",
        ),
    ] = None
    to: Destinations
    passes: PassesOption = None
    offload: OffloadOption = False
    print_after: Annotated[
        str | None,
        typer.Option(metavar="PASS", help="Print the result of this pass, or of `all` passes."),
    ] = None
    rates: Annotated[
        list[str],
        typer.Option(
            "--rate-hz",
            metavar="[NAME=]RATE",
            help="Firing rate for the estimates of energy and time, in Hz: of all neurons, of the "
            "ensemble NAME, or, as host=RATE, of the spikes from the host; repeatable.",
            default_factory=list,
            show_default=False,
        ),
    ]
    loss_s: Annotated[
        float | None,
        typer.Option(
            "--loss",
            metavar="SECONDS",
            help="Run the network this long, and measure its errors from rounding.",
        ),
    ] = None
    limits: Limits
    cores: Annotated[
        bool, typer.Option("--cores", help="Print tables of all cores and modules.")
    ] = False
    build_timeout_s: BuildTimeout = None


@dataclass(frozen=True, kw_only=True)
class SimulateRequest:
    """A run of a network, as the user asked for it, without the link to a board."""

    network: Annotated[str, typer.Argument(metavar="MODEL", help=MODEL)]
    backend: Annotated[
        str,
        typer.Option(
            help="native, native-threads, nengo-loihi, reference, board or replay; see "
            "`spikeport backends`."
        ),
    ] = Target.backend
    chip: ChipOption = Target.chip
    passes: PassesOption = None
    offload: OffloadOption = False
    seconds: Annotated[
        float, typer.Option(help="Simulated time, in s; each step of a NIR graph is 1 ms of it.")
    ] = 1.0
    seed: SeedOption = 0
    settings: SettingsOption
    dt_s: GraphStep = None
    spikes: Annotated[
        str | None,
        typer.Option(metavar="FILE.npz", help="Input spikes for a NIR graph, or `random`."),
    ] = None
    beside_float: Annotated[
        bool,
        typer.Option(
            "--float/--no-float", help="Run the network in ordinary Nengo, too, and compare."
        ),
    ] = True
    out: RunFolder = None
    overwrite: Overwrite = False
    counts: CountsOption = False
    build_timeout_s: BuildTimeout = None

    @property
    def target(self) -> Target:
        """The backend and chip, and the passes."""
        return Target(backend=self.backend, chip=self.chip, passes=self.passes)


@dataclass(frozen=True, kw_only=True)
class ConvertRequest:
    """A conversion of a policy, as the user asked for it."""

    file: Annotated[
        Path,
        typer.Argument(
            help="A policy: npz of `train`, TorchScript, checkpoint of rsl-rl, or ONNX; or the "
            "name of a shipped one, h1_walk or h1_robust."
        ),
    ]
    description: Annotated[
        Path | None,
        typer.Option(help="Isaac Lab's env.yaml, for a walking policy trained in Isaac Lab."),
    ] = None
    observations: Annotated[
        Path | None, typer.Option(help="npz file with typical observations, an array (n, inputs).")
    ] = None
    activation: Annotated[
        str | None,
        typer.Option(help="Activation of a checkpoint, which does not contain it; by default elu."),
    ] = None
    output: Annotated[
        str | None, typer.Option(help="Name of the action, if an ONNX file has other outputs.")
    ] = None
    n_neurons: Annotated[
        int,
        typer.Option("--neurons", "-n", help="Number of neurons for each unit, an even one."),
    ] = 20
    tau_fwd: Annotated[
        float, typer.Option(help="Time constant of the filter between layers, in s.")
    ] = 0.002
    chip: ChipOption = "loihi"
    passes: Annotated[
        str | None,
        typer.Option(
            "--passes",
            "-p",
            metavar="PASSES",
            help=f"{PASSES_HELP} By default compact, with decode_path{{slack_cores=16}}.",
        ),
    ] = None
    seed: Annotated[int, seed_of("the neurons")] = 0
    to: Destinations
