"""The command line.

Exit codes: 0 done, 1 the network does not fit or a run failed, 2 wrong use, 130 interrupted. Which
of 1 and 2 it is belongs to the class of the error: `SpikeportError.exit_code`.
"""

import os
import sys
import warnings
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
import typer.core

from spikeport import __version__
from spikeport.errors import SpikeportError


class Commands(typer.core.TyperGroup):
    """The commands; one that is interrupted says so, where typer would exit in silence."""

    def invoke(self, ctx: Any) -> object:
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
LARGEST_SEED = 2**32 - 1
"""Of NumPy's random states."""

Chip = Annotated[str, typer.Option(help="A chip's name, or the path of its TOML file.")]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="A setting; repeatable.")
]


Backend = Annotated[
    str, typer.Option(help="analytic, reference, native or nengo-loihi; see `backends`.")
]
Seed = Annotated[int, typer.Option(help="Seed of the run.", min=0, max=LARGEST_SEED)]
Seconds = Annotated[float | None, typer.Option(help="Simulated time.")]
Out = Annotated[Path | None, typer.Option(help="Folder of the run.")]
Overwrite = Annotated[bool, typer.Option(help="Replace an earlier run in --out.")]
Video = Annotated[bool, typer.Option("--video", help="Write video.mp4 too.")]
NWorkers = Annotated[int | None, typer.Option("--workers", help="Processes; all cores.", min=1)]
Scheduler = Annotated[
    str | None, typer.Option(metavar="tcp://...", help="Of a Dask cluster, in place of processes.")
]


RateHz = Annotated[
    list[str] | None,
    typer.Option(
        "--rate-hz",
        metavar="[NAME=]RATE",
        help="Reckon energy and time at firing rates: of all, of an ensemble or of `host`.",
    ),
]


Passes = Annotated[
    str | None,
    typer.Option(
        "--passes",
        "-p",
        metavar="PASSES",
        help="as_written, compact, or name,name{key=value}; by default the chip's; see `passes`.",
    ),
]
PrintAfter = Annotated[
    str | None, typer.Option(metavar="PASS", help="Print what a pass, or each of `all`, leaves.")
]


def explained(rule: str | None) -> None:
    """Print what a rule is, and stop."""
    if rule is not None:
        from spikeport.commands.explain import explain

        explain(rule)
        raise typer.Exit


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
    passes: Passes = None,
    print_after: PrintAfter = None,
    rate_hz: RateHz = None,
    loss: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Run, and say what rounding costs.")
    ] = None,
    max_cores: Annotated[int | None, typer.Option(help="Exit with 1 above this.")] = None,
    max_power: Annotated[float | None, typer.Option(metavar="W", help="The same of power.")] = None,
    max_step_us: Annotated[float | None, typer.Option(help="The same of a step's time.")] = None,
    cores: Annotated[
        bool, typer.Option("--cores", help="Print the tables of all cores and modules.")
    ] = False,
    explain: Annotated[
        str | None,
        typer.Option(
            metavar="RULE", help="Explain a rule, e.g. SP101.", callback=explained, is_eager=True
        ),
    ] = None,
) -> None:
    """Compile a network: say whether it fits, what it costs and what it loses."""
    from spikeport.commands.compile import Request, run
    from spikeport.compile.report.budget import Budget

    budget = Budget(max_cores, max_power, max_step_us)
    run(
        Request(
            network,
            chip,
            settings or [],
            out,
            json,
            rate_hz or [],
            loss,
            budget,
            cores,
            passes,
            print_after,
        )
    )


@app.command("show")
def show_command(
    image: Annotated[Path, typer.Argument(help="The image.npz that a compile wrote.")],
) -> None:
    """Print what is in a chip image: chip, digest, blocks, cores, inputs and outputs."""
    from spikeport.commands.show import run

    run(image)


@app.command("step")
def step_command(
    image: Annotated[Path, typer.Argument(help="The image.npz that a compile wrote.")],
    steps: Annotated[int, typer.Option(help="Number of steps.", min=1, max=10**9)],
    out: Annotated[Path, typer.Option(help="npz to write outputs and activity to.")],
    spikes: Annotated[
        Path | None,
        typer.Option(help="npz of input spikes, with arrays `steps` and `sources`."),
    ] = None,
    seed: Seed = 0,
) -> None:
    """Step a chip image on the native backend, without the network it was made of."""
    from spikeport.commands.step import run

    run(image, spikes, steps, out, seed)


@app.command("convert")
def convert_command(
    file: Annotated[
        Path, typer.Argument(help="npz of ours, TorchScript, checkpoint of rsl-rl, or ONNX.")
    ],
    description: Annotated[
        Path | None, typer.Option(help="Isaac Lab's env.yaml of a foreign walking policy.")
    ] = None,
    observations: Annotated[
        Path | None, typer.Option(help="npz with an array (n, inputs): what it will see.")
    ] = None,
    activation: Annotated[
        str, typer.Option(help="Of a checkpoint, which does not name its own.")
    ] = "elu",
    neurons: Annotated[int, typer.Option("--neurons", "-n", help="Neurons of a unit.")] = 20,
    tau_fwd: Annotated[float, typer.Option(help="Filter between layers, in s.")] = 0.002,
    chip: Chip = "loihi",
    passes: Annotated[str, typer.Option("--passes", "-p", help="See `passes`.")] = "compact",
    seed: Seed = 0,
    out: Annotated[Path | None, typer.Option(help="Folder to write image and report to.")] = None,
    json: Annotated[Path | None, typer.Option(help="File to write the report to.")] = None,
) -> None:
    """Convert a perceptron into spikes: what it takes on the chip, and the error of each layer."""
    from spikeport.commands.convert import Request, run

    run(
        Request(
            file,
            description,
            observations,
            activation,
            neurons,
            tau_fwd,
            chip,
            passes,
            seed,
            out,
            json,
        )
    )


@app.command("diff")
def diff_command(
    a: Annotated[Path, typer.Argument(help="A report, or the folder of a compile or run.")],
    b: Annotated[Path, typer.Argument(help="Another.")],
) -> None:
    """Compare two compiles or runs: exits with 1 if any figure differs, else 0."""
    from spikeport.commands.diff import run

    raise typer.Exit(run(a, b))


@app.command("run")
def run_command(
    experiment: Annotated[str, typer.Argument(help="The experiment, e.g. reach.")],
    backend: Backend = "native",
    chip: Chip = "loihi",
    passes: Passes = None,
    seed: Seed = 0,
    seconds: Seconds = None,
    settings: Settings = None,
    out: Out = None,
    overwrite: Overwrite = False,
    video: Video = False,
) -> None:
    """Run an experiment of the paper in closed loop, and write its folder."""
    from spikeport.commands.run import Request, run

    chosen = settings or []
    run(Request(experiment, backend, chip, passes, seed, seconds, chosen, out, overwrite, video))


@app.command("calibrate")
def calibrate_command(
    experiment: Annotated[str, typer.Argument(help="The experiment, e.g. reach.")],
    out: Annotated[Path, typer.Option(help="File to write, for `run --set calibrated=FILE`.")],
    backend: Backend = "native",
    chip: Chip = "loihi",
    passes: Passes = None,
    seconds: Seconds = None,
    settings: Settings = None,
) -> None:
    """Refit an experiment's decoders to what its neurons do on a backend, and write them."""
    from spikeport.commands.calibrate import Request, run

    run(Request(experiment, backend, chip, passes, seconds, settings or [], out))


@app.command("train")
def train_command(
    policy: Annotated[str, typer.Argument(help="The policy to train: walk.")],
    out: Annotated[Path, typer.Option(help="Folder of the run; one that is there goes on.")] = Path(
        "runs/train-walk"
    ),
    seed: Annotated[int, typer.Option(help="Seed of the run.", min=0, max=LARGEST_SEED)] = 0,
    steps: Annotated[int, typer.Option(help="Control steps of all robots.", min=1)] = 23_300_000,
    threads: Annotated[int | None, typer.Option(help="Threads; all cores.", min=1)] = None,
) -> None:
    """Train a policy from scratch; a run that was interrupted goes on where it was."""
    from spikeport.commands.train import run

    run(policy, out, seed, steps, threads)


@app.command("figure")
def figure_command(
    figure: Annotated[
        str,
        typer.Argument(
            help="reach (the paper's Fig. 4), draw (Fig. 5), walk (6a), walk-sweep (6b) or "
            "walk-silenced (6c)."
        ),
    ],
    backend: Backend = "native",
    chip: Chip = "loihi",
    passes: Passes = None,
    seed: Seed = 0,
    seconds: Seconds = None,
    settings: Settings = None,
    out: Out = None,
    overwrite: Overwrite = False,
    video: Video = False,
    workers: NWorkers = None,
    scheduler: Scheduler = None,
) -> None:
    """Make a figure of the paper: a run or a sweep with its settings, and its folder."""
    from spikeport.commands import figure as command
    from spikeport.commands.run import Request

    chosen = settings or []
    request = Request(figure, backend, chip, passes, seed, seconds, chosen, out, overwrite, video)
    raise typer.Exit(command.figure(request, command.Workers(workers, scheduler)))


@app.command("sweep")
def sweep_command(
    experiment: Annotated[str, typer.Argument(help="The experiment, e.g. walk.")],
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE,...", help="Values of a setting or `backend`; repeatable."),
    ] = None,
    seeds: Annotated[int, typer.Option(help="How many, from 0 on.", min=1)] = 1,
    backend: Backend = "native",
    chip: Chip = "loihi",
    passes: Passes = None,
    seconds: Seconds = None,
    settings: Settings = None,
    probes: Annotated[bool, typer.Option("--probes", help="Keep the time series too.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder; a sweep that is there goes on.")] = None,
    workers: NWorkers = None,
    scheduler: Scheduler = None,
) -> None:
    """Run an experiment at many settings, each from several seeds; resumes where it was."""
    from spikeport.commands.sweep import Request, run

    raise typer.Exit(
        run(
            Request(
                experiment,
                vary or [],
                tuple(range(seeds)),
                backend,
                chip,
                passes,
                seconds,
                settings or [],
                out,
                workers or os.cpu_count() or 1,
                scheduler,
                probes,
            )
        )
    )


@app.command()
def chips() -> None:
    """List the chips, with their limits and where each figure comes from."""
    from spikeport.commands.lists import print_chips

    print_chips()


@app.command()
def passes() -> None:
    """List the passes of a compile, their options and the chips' pipelines."""
    from spikeport.commands.passes import print_passes

    print_passes()


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
    warnings.filterwarnings("ignore", module="spikeport.compile")  # they stand in the report
    try:
        app(prog_name="spikeport")
    except SpikeportError as error:
        fail(str(error), error.exit_code)
    except OSError as error:
        reason = error.strerror or ", ".join(map(str, error.args))
        fail(f"{error.filename or 'system'}: {reason}", 1)


def fail(message: str, code: int) -> NoReturn:
    """Print an error and exit."""
    typer.echo(f"error: {message}", err=True)
    sys.exit(code)
