"""The command line.

Exit codes: 0 done, 1 the network does not fit, a run failed or a user's function raised, 2 wrong
use or a file that is refused or cannot be imported, 130 interrupted, 128 + n ended by signal n. The
class of an error decides between 1 and 2: `SpikeportError.exit_code`.
"""

import os
import sys
import warnings
from pathlib import Path
from typing import Annotated, Any, NoReturn, TextIO

import typer
import typer.core

from spikeport import __version__
from spikeport.cli_servers import board_app, robot_app
from spikeport.commands import process
from spikeport.commands.option_groups import with_options
from spikeport.commands.options import (
    PASSES_HELP,
    ChipOption,
    CountsOption,
    ImageFile,
    NoCache,
    OffloadOption,
    Overwrite,
    PassesOption,
    RunFolder,
    RunOptions,
    SecondsOption,
    SeedOption,
    SettingsOption,
    Target,
    Workers,
    seed_of,
    written,
)
from spikeport.commands.options_of_links import Link, RobotLink, Tls
from spikeport.constants import MOST_POINTS
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
MODEL = (
    "FILE.py or FILE.ipynb, with a network called `model` or `net`, or with a single network or "
    "function that makes one; FILE.py:NAME, FILE.ipynb:NAME or module:NAME of a network, or of a "
    "function that makes one; or graph.nir."
)
RateHz = Annotated[
    list[str] | None,
    typer.Option(
        "--rate-hz",
        metavar="[NAME=]RATE",
        help="Firing rate for the estimates of energy and time, in Hz: of all neurons, of the "
        "ensemble NAME, or, as host=RATE, of the spikes from the host; repeatable.",
    ),
]
PrintAfter = Annotated[
    str | None,
    typer.Option(metavar="PASS", help="Print the result of this pass, or of `all` passes."),
]
BuildTimeout = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        min=0.001,
        max=10**6,
        help="Give up if your code takes longer to make the network; the compile has no limit.",
    ),
]
GraphStep = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="Time step of a NIR graph, which needs one, in s."),
]
ExperimentName = Annotated[str, typer.Argument(help="The experiment: draw, reach, switch or walk.")]
ImageFolder = Annotated[Path | None, written("Write image and report to this folder.")]
ReportFile = Annotated[Path | None, written("Write the report to this file, as JSON.")]
ReportPage = Annotated[Path | None, written("Write the report to this file, as a web page.")]
ComparisonPage = Annotated[
    Path | None, written("Write the comparison to this file, as a web page.")
]


def explained(rule: str | None) -> None:
    """Print the explanation of a rule, and stop."""
    if rule is not None:
        from spikeport.commands.explain import explain

        explain(rule)
        raise typer.Exit


@app.callback(invoke_without_command=True)
def root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    """Print the version if `--version` asks for it."""
    if version:
        typer.echo(f"spikeport {__version__}")
        raise typer.Exit


@app.command("compile")
def compile_command(
    network: Annotated[
        str, typer.Argument(metavar="MODEL", help=f"{MODEL} Or built in: arm, walk, humanoid.")
    ],
    chip: ChipOption = "loihi",
    *,
    settings: SettingsOption,
    dt: GraphStep = None,
    spikes: Annotated[
        str | None,
        typer.Option(
            metavar="FILE.npz",
            help="Input spikes, or `random`, to compare a NIR graph with NIR's equations.",
        ),
    ] = None,
    out: ImageFolder = None,
    json: ReportFile = None,
    html: ReportPage = None,
    passes: PassesOption = None,
    offload: OffloadOption = False,
    print_after: PrintAfter = None,
    rate_hz: RateHz = None,
    loss: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="Run the network this long, and measure its errors from rounding.",
        ),
    ] = None,
    max_cores: Annotated[
        int | None, typer.Option(help="Exit with 1 if the network takes more cores.")
    ] = None,
    max_power: Annotated[
        float | None,
        typer.Option(
            metavar="W",
            help="Exit with 1 if the network takes more power; needs --rate-hz or --loss.",
        ),
    ] = None,
    max_step_us: Annotated[
        float | None,
        typer.Option(
            metavar="US",
            help="Exit with 1 if a step takes longer, in us; needs --rate-hz or --loss.",
        ),
    ] = None,
    cores: Annotated[
        bool, typer.Option("--cores", help="Print tables of all cores and modules.")
    ] = False,
    build_timeout: BuildTimeout = None,
    no_cache: NoCache = False,
    explain: Annotated[
        str | None,
        typer.Option(
            metavar="RULE", help="Explain a rule, e.g. SP101.", callback=explained, is_eager=True
        ),
    ] = None,
) -> None:
    """Compile a network, and print whether it fits, its costs and its losses."""
    from spikeport.commands.compile import CompileRequest, run
    from spikeport.commands.destinations import Destinations
    from spikeport.compile.report.budget import Budget

    run(
        CompileRequest(
            network=network,
            chip=chip,
            settings=settings,
            to=Destinations(out=out, json=json, html=html),
            rates=rate_hz or [],
            loss_s=loss,
            budget=Budget(cores=max_cores, power_w=max_power, step_us=max_step_us),
            cores=cores,
            passes=passes,
            print_after=print_after,
            build_timeout_s=build_timeout,
            offload=offload,
            dt_s=dt,
            spikes=spikes,
        )
    )


@app.command("simulate")
@with_options
def simulate_command(
    model: Annotated[str, typer.Argument(metavar="MODEL", help=MODEL)],
    backend: Annotated[
        str,
        typer.Option(
            help="native, native-threads, nengo-loihi, reference, board or replay; see "
            "`spikeport backends`."
        ),
    ] = "native",
    chip: ChipOption = "loihi",
    passes: PassesOption = None,
    offload: OffloadOption = False,
    *,
    seconds: Annotated[
        float, typer.Option(help="Simulated time, in s; each step of a NIR graph is 1 ms of it.")
    ] = 1.0,
    seed: SeedOption = 0,
    settings: SettingsOption,
    dt: GraphStep = None,
    spikes: Annotated[
        str | None,
        typer.Option(metavar="FILE.npz", help="Input spikes for a NIR graph, or `random`."),
    ] = None,
    beside_float: Annotated[
        bool,
        typer.Option(
            "--float/--no-float", help="Run the network in ordinary Nengo, too, and compare."
        ),
    ] = True,
    out: RunFolder = None,
    overwrite: Overwrite = False,
    counts: CountsOption = False,
    build_timeout: BuildTimeout = None,
    link: Link,
    tls: Tls,
) -> None:
    """Simulate a network on a chip, and compare every probe with ordinary Nengo."""
    from spikeport.commands.links import link_options
    from spikeport.commands.simulate import SimulateRequest, simulate

    simulate(
        SimulateRequest(
            network=model,
            target=Target(backend=backend, chip=chip, passes=passes),
            offload=offload,
            seconds=seconds,
            seed=seed,
            settings=settings,
            dt_s=dt,
            spikes=spikes,
            beside_float=beside_float,
            out=out,
            overwrite=overwrite,
            counts=counts,
            build_timeout_s=build_timeout,
            link=link_options(link, tls, backend),
        )
    )


@app.command("show")
def show_command(
    image: ImageFile,
) -> None:
    """Print what is in a chip image: chip, digest, blocks, cores, inputs and outputs."""
    from spikeport.commands.show import run

    run(image)


@app.command("view")
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


@app.command("step")
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


@app.command("export")
def export_command(
    image: ImageFile,
    nir: Annotated[Path, written("Write a NIR graph to this file.")],
) -> None:
    """Export a chip image as a NIR graph, in the chip's integers."""
    from spikeport.commands.export import run

    run(image, nir)


@app.command("convert")
def convert_command(
    file: Annotated[
        Path,
        typer.Argument(
            help="A policy: npz of `train`, TorchScript, checkpoint of rsl-rl, or ONNX; or the "
            "name of a shipped one, h1_walk or h1_robust."
        ),
    ],
    description: Annotated[
        Path | None,
        typer.Option(help="Isaac Lab's env.yaml, for a walking policy trained in Isaac Lab."),
    ] = None,
    observations: Annotated[
        Path | None, typer.Option(help="npz file with typical observations, an array (n, inputs).")
    ] = None,
    activation: Annotated[
        str | None,
        typer.Option(help="Activation of a checkpoint, which does not contain it; by default elu."),
    ] = None,
    output: Annotated[
        str | None, typer.Option(help="Name of the action, if an ONNX file has other outputs.")
    ] = None,
    neurons: Annotated[
        int,
        typer.Option("--neurons", "-n", help="Number of neurons for each unit, an even one."),
    ] = 20,
    tau_fwd: Annotated[
        float, typer.Option(help="Time constant of the filter between layers, in s.")
    ] = 0.002,
    chip: ChipOption = "loihi",
    passes: Annotated[
        str | None,
        typer.Option(
            "--passes",
            "-p",
            metavar="PASSES",
            help=f"{PASSES_HELP} By default compact, with decode_path{{slack_cores=16}}.",
        ),
    ] = None,
    seed: Annotated[int, seed_of("the neurons")] = 0,
    out: ImageFolder = None,
    json: ReportFile = None,
    html: ReportPage = None,
) -> None:
    """Convert a perceptron into a spiking network, and print the error of each layer."""
    from spikeport.commands.convert import ConvertRequest, run
    from spikeport.commands.destinations import Destinations

    run(
        ConvertRequest(
            file=file,
            description=description,
            observations=observations,
            activation=activation,
            output=output,
            n_neurons=neurons,
            tau_fwd=tau_fwd,
            chip=chip,
            passes=passes,
            seed=seed,
            to=Destinations(out=out, json=json, html=html),
        )
    )


@app.command("diff")
def diff_command(
    a: Annotated[
        Path, typer.Argument(help="A report, or the folder of a compile, run or evaluation.")
    ],
    b: Annotated[Path, typer.Argument(help="The report or folder to compare with.")],
    html: ComparisonPage = None,
) -> None:
    """Compare the figures of two compiles or runs on a chip, or of two evaluations.

    Exit with 1 if a figure, setting, seed or version differs; a figure of an evaluation, if it does
    by more than chance.
    """
    from spikeport.commands.diff import run

    raise typer.Exit(run(a, b, html))


@app.command("run")
@with_options
def run_command(
    experiment: ExperimentName,
    target: Target,
    options: RunOptions,
    link: Link,
    tls: Tls,
    robot_link: RobotLink,
) -> None:
    """Run an experiment of the paper in closed loop with the robot."""
    from spikeport.commands.links import link_options, robot_options
    from spikeport.commands.run import RunRequest, run

    run(
        RunRequest(
            experiment=experiment,
            target=target,
            options=options,
            link=link_options(link, tls, target.backend),
            robot=robot_options(robot_link),
        )
    )


@app.command("calibrate")
@with_options
def calibrate_command(
    experiment: ExperimentName,
    *,
    out: Annotated[
        Path, written("Write the calibration to this file, for `run --set calibrated=FILE`.")
    ],
    target: Target,
    seconds: SecondsOption = None,
    settings: SettingsOption,
) -> None:
    """Calibrate an experiment: refit its decoders to its neurons on a backend."""
    from spikeport.commands.calibrate import CalibrateRequest, run

    run(
        CalibrateRequest(
            experiment=experiment, target=target, seconds=seconds, settings=settings, out=out
        )
    )


@app.command("train")
def train_command(
    policy: Annotated[str, typer.Argument(help="The policy to train: walk.")],
    out: Annotated[Path, written("Folder of the run; an earlier run in it is resumed.")] = Path(
        "runs/train-walk"
    ),
    seed: Annotated[int, seed_of("the training")] = 0,
    steps: Annotated[
        int,
        typer.Option(
            help="Control steps of all robots together, rounded up to a multiple of 307,200.",
            min=1,
        ),
    ] = 48_000_000,
    threads: Annotated[
        int | None,
        typer.Option(help="Number of threads; by default one for each processor core.", min=1),
    ] = None,
    no_hidden_noise: Annotated[
        bool,
        typer.Option("--no-hidden-noise", help="Train without the noise that stands for spikes."),
    ] = False,
) -> None:
    """Train a policy from scratch, or resume an interrupted run."""
    from spikeport.commands.train import run

    run(
        policy,
        out=out,
        seed=seed,
        steps=steps,
        threads=threads,
        hidden_noise=not no_hidden_noise,
    )


@app.command("figure")
@with_options
def figure_command(
    figure: Annotated[
        str,
        typer.Argument(
            help="The paper's number, or a name: 1 teaser, 2 overview, 3 reach, 4 draw, 5a walk, "
            "5b walk-sweep, 5c walk-silenced, 6 basal-ganglia."
        ),
    ],
    target: Target,
    options: RunOptions,
    workers: Workers,
) -> None:
    """Make a figure of the paper by its run, or by its sweep for 5a and 5b.

    Figure 2 is drawn from the network, without a run. Options of another kind are refused.
    """
    from spikeport.commands.figure import FigureRequest, make

    request = FigureRequest(figure=figure, target=target, options=options, workers=workers)
    raise typer.Exit(make(request))


@app.command("sweep")
@with_options
def sweep_command(
    experiment: ExperimentName,
    *,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE,...",
            help="Values of a setting, or of `backend`; separated by `;` if a value has commas; "
            "repeatable.",
        ),
    ] = None,
    seeds: Annotated[
        int, typer.Option(help="Number of seeds, starting at 0.", min=1, max=MOST_POINTS)
    ] = 1,
    target: Target,
    seconds: SecondsOption = None,
    settings: SettingsOption,
    probes: Annotated[
        bool, typer.Option("--probes", help="Keep the time series of each run, too.")
    ] = False,
    out: Annotated[
        Path | None,
        written("Folder of the sweep, by default a new one in runs/; an earlier sweep is resumed."),
    ] = None,
    no_cache: NoCache = False,
    workers: Workers,
) -> None:
    """Run an experiment with many settings and seeds, or resume such a sweep."""
    from spikeport.commands.sweep import SweepRequest, run

    request = SweepRequest(
        experiment=experiment,
        target=target,
        vary=vary or [],
        seeds=tuple(range(seeds)),
        seconds=seconds,
        settings=settings,
        out=out,
        workers=workers,
        probes=probes,
    )
    raise typer.Exit(run(request))


@app.command("evaluate")
@with_options
def evaluate_command(
    experiment: Annotated[str, typer.Argument(help="The policy's experiment: walk.")],
    *,
    row: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE,...",
            help="Perturbations of a row; replaces all default rows but the nominal; repeatable.",
        ),
    ] = None,
    episodes: Annotated[
        int, typer.Option(help="Number of episodes for each row.", min=1, max=MOST_POINTS)
    ] = 20,
    seed: Annotated[int, seed_of("the first episode; each further episode has the next")] = 0,
    target: Target,
    seconds: Annotated[
        float | None, typer.Option(help="Length of an episode, in s; by default 20.")
    ] = None,
    settings: SettingsOption,
    out: Annotated[
        Path | None,
        written(
            "Folder of the evaluation, by default a new one in runs/; an earlier one is resumed."
        ),
    ] = None,
    no_cache: NoCache = False,
    workers: Workers,
) -> None:
    """Evaluate the robustness of a policy: falls, tracking, margins, gait."""
    from spikeport.commands.evaluate import EvaluateRequest, run

    request = EvaluateRequest(
        experiment=experiment,
        target=target,
        rows=row or [],
        episodes=episodes,
        seed=seed,
        seconds=seconds,
        settings=settings,
        out=out,
        workers=workers,
    )
    raise typer.Exit(run(request))


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
    """Print a warning in one line, without the line of code that it comes from."""
    typer.echo(f"warning: {printable(str(message))}", err=True)


def fail_interrupted(left: str = "") -> NoReturn:
    """Print that Ctrl-C ended a command, and the results that are ``left`` by it, and exit."""
    fail(f"interrupted; {left or 'no result was completed'}", 130)


def fail(message: str, code: int) -> NoReturn:
    """Print an error with its control characters escaped, and exit."""
    text = printable(message, kept="\n")
    typer.echo(f"error: {text}", err=True)
    sys.exit(code)
