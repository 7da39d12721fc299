"""``spikeport figure``: a figure of the paper, from runs with the paper's settings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from spikeport.commands import run, sweep
from spikeport.commands.checks import check_seeds, check_target
from spikeport.commands.options import RunOptions, Target, Workers
from spikeport.commands.options_of_experiments import SweepRequest
from spikeport.errors import UsageError, unknown
from spikeport.experiments import registry, run_folder
from spikeport.experiments.options import REPLAY, WITHOUT_NEURONS
from spikeport.experiments.sweep.plan import BACKEND
from spikeport.find_network import built_in
from spikeport.plots import rendered


@dataclass(frozen=True, kw_only=True)
class FigureRequest:
    """A figure of the paper, as the user asked for it."""

    figure: str
    target: Target
    options: RunOptions
    workers: Workers


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the paper from a single run."""

    summary: str
    experiment: str
    settings: Mapping[str, str]

    def make(self, request: FigureRequest) -> int:
        """Run the experiment, and return 0; UsageError for options that a single run lacks."""
        if request.workers != Workers():
            raise UsageError(
                f"figure '{request.figure}' is a single run; leave out --workers and --scheduler"
            )
        _check_neurons(request)
        _refuse_replay(request)
        settings = _replaced(self.settings, request.options.settings)
        options = replace(request.options, settings=settings)
        run.run(run.RunRequest(experiment=self.experiment, target=request.target, options=options))
        return 0


@dataclass(frozen=True)
class PaperSweep:
    """A figure of the paper from many runs, with varied settings and several seeds."""

    summary: str
    experiment: str
    settings: Mapping[str, str]
    vary: Sequence[str]
    n_seeds: int
    figure: str
    probes: bool = False
    seconds: float | None = None
    """By default those of the experiment."""

    def make(self, request: FigureRequest) -> int:
        """Run the missing points of the sweep, from the seed of the request on, and draw it.

        Return 1 if a point failed, else 0; UsageError for options that only a single run has.
        """
        asked = request.options
        if asked.video or asked.overwrite or asked.counts:
            raise UsageError(
                f"figure '{request.figure}' is a sweep, which goes on with what is in --out; "
                "leave out --video, --overwrite and --counts"
            )
        self._check_varied(request)
        _check_neurons(request)
        check_seeds(asked.seed, self.n_seeds, "runs")
        return sweep.run(
            SweepRequest(
                experiment=self.experiment,
                target=request.target,
                vary=list(self.vary),
                first_seed=asked.seed,
                n_seeds=self.n_seeds,
                seconds=self.seconds if asked.seconds is None else asked.seconds,
                settings=_replaced(self.settings, asked.settings),
                out=asked.out,
                workers=request.workers,
                probes=self.probes,
                figure=self.figure,
            )
        )

    def _check_varied(self, request: FigureRequest) -> None:
        """Refuse a user's value for a setting that the figure varies."""
        given = {key: f"--set {key}" for key in _keys(request.options.settings)}
        if request.target.backend != Target.backend:
            given[BACKEND] = f"--{BACKEND}"
        for key in _keys(self.vary):
            if key in given:
                raise UsageError(
                    f"{given[key]}: figure '{request.figure}' varies it; cure: leave it out"
                )


@dataclass(frozen=True)
class PaperOverview:
    """A figure of the paper that is drawn from the network itself, without a run."""

    summary: str
    module: str

    def make(self, request: FigureRequest) -> int:
        """Build the network, draw it, and return 0."""
        asked = request.options
        ignored = asked.video, asked.counts, asked.seconds is not None, asked.seed
        if any(ignored) or request.workers != Workers() or request.target != _chip_target(request):
            raise UsageError(
                "figure 'overview' is drawn without a run: it takes --set, --chip, --out and "
                "--overwrite; cure: leave the others out"
            )
        check_target(request.target)
        drawing = registry.imported("figure 'overview'", self.module)
        with run_folder.opened(asked.out, "overview", asked.overwrite) as folder:
            # A calibration takes a run, and does not change the drawing.
            settings = _replaced({"calibrated": "false"}, asked.settings)
            # Its time is not limited: the message would name an option that figures lack.
            network = built_in("humanoid", settings, request.target.chip)
            picture = rendered(drawing.overview_figure(network))
            with run_folder.renewed(folder) as new:
                run_folder.write_figure(new, picture)
        print(f"written: {folder}/ (figure.png)")
        return 0


def _check_neurons(request: FigureRequest) -> None:
    """Refuse the backend without neurons, whose settings the paper's figures have."""
    if request.target.backend == WITHOUT_NEURONS:
        raise UsageError(
            f"--backend {WITHOUT_NEURONS}: has no neurons, which figure '{request.figure}' shows; "
            "cure: leave it out"
        )


def _refuse_replay(request: FigureRequest) -> None:
    """Refuse the backend that plays back a record: figures have no option that names one."""
    if request.target.backend == REPLAY:
        raise UsageError(
            f"--backend {REPLAY}: figures take no record of a run; cure: leave it out, or "
            f"spikeport run with --backend {REPLAY} --replay FILE"
        )


def _chip_target(request: FigureRequest) -> Target:
    """Return the target that a request has if it asks for a chip alone."""
    return Target(chip=request.target.chip)


def _replaced(papers: Mapping[str, str], own: Sequence[str]) -> list[str]:
    """Return the paper's settings, replaced and extended by the user's."""
    keys = _keys(own)
    return [*(f"{key}={value}" for key, value in papers.items() if key not in keys), *own]


def _keys(pairs: Sequence[str]) -> list[str]:
    """Return the keys of ``KEY=VALUE`` texts."""
    return [pair.partition("=")[0] for pair in pairs]


SWEEP_S = 20.0
"""Five of the six turns of the path."""

FIGURES: dict[str, PaperFigure | PaperOverview | PaperSweep] = {
    "teaser": PaperFigure("Fig. 1: walking, drawing and walking on", "switch", {}),
    "overview": PaperOverview(
        "Fig. 2: parts, populations and connections", "spikeport.experiments.switch.overview"
    ),
    "reach": PaperFigure("Fig. 3: reach-to-target", "reach", {"preset": "paper"}),
    "draw": PaperFigure("Fig. 4: a digit", "draw", {"preset": "paper", "digit": "5"}),
    "walk": PaperSweep(
        "Fig. 5a: reference policy and spiking policy",
        "walk",
        {"path": "loop", "n_neurons": "20"},
        ["policy=mlp,spiking"],
        5,
        "spikeport.experiments.walk.trajectories",
        probes=True,
    ),
    "walk-sweep": PaperSweep(
        "Fig. 5b: neurons of a unit, and filters between layers",
        "walk",
        {"path": "loop", "calibrated": "false"},
        ["n_neurons=2,6,20,40", "tau_fwd=.001,.002,.005,.01", "backend=reference,native"],
        5,
        "spikeport.experiments.walk.sweep_figure",
        seconds=SWEEP_S,
    ),
    "walk-silenced": PaperFigure(
        "Fig. 5c: half of the ensembles fall silent",
        "walk",
        {"path": "loop", "n_neurons": "20", "silence": "0.5", "silence_at": "25"},
    ),
    "basal-ganglia": PaperFigure("Fig. 6: spikes of the basal ganglia", "switch", {}),
}
NUMBERS = {
    "1": "teaser",
    "2": "overview",
    "3": "reach",
    "4": "draw",
    "5a": "walk",
    "5b": "walk-sweep",
    "5c": "walk-silenced",
    "6": "basal-ganglia",
}
"""The numbers of the paper's figures, each with the name of the same figure."""


def make(request: FigureRequest) -> int:
    """Make a figure with the paper's settings, except those that the request replaces.

    Return 1 if a point of a sweep failed, else 0.

    Raises
    ------
    UsageError
        If the paper has no figure of that name, or as `spikeport.commands.run.run`.
    """
    name = NUMBERS.get(request.figure, request.figure)
    if name not in FIGURES:
        raise unknown("figure", name, [*NUMBERS, *FIGURES])
    return FIGURES[name].make(request)
