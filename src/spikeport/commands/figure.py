"""``spikeport figure``: a figure of the paper, from runs with the paper's settings."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from spikeport.commands import run, sweep
from spikeport.errors import UsageError, unknown


@dataclass(frozen=True)
class Workers:
    """Where a sweep runs, if the user says so: processes of this machine, or a Dask scheduler."""

    n: int | None = None
    scheduler: str | None = None


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the paper: which, and the run that shows it."""

    summary: str
    experiment: str
    seconds: float
    settings: Mapping[str, str]

    def make(self, request: run.Request, workers: Workers) -> int:
        """Run the experiment; 0, or UsageError for options that only a sweep has."""
        if workers != Workers():
            raise UsageError(
                f"figure '{request.experiment}' is a single run; leave out --workers and "
                "--scheduler"
            )
        seconds = self.seconds if request.seconds is None else request.seconds
        settings = _replaced(self.settings, request.settings)
        run.run(replace(request, experiment=self.experiment, seconds=seconds, settings=settings))
        return 0


@dataclass(frozen=True)
class PaperSweep:
    """A figure of the paper from many runs: what differs, from how many seeds, who draws it."""

    summary: str
    experiment: str
    seconds: float
    settings: Mapping[str, str]
    vary: Sequence[str]
    n_seeds: int
    figure: str
    probes: bool = False

    def make(self, request: run.Request, workers: Workers) -> int:
        """Run what is missing of the sweep, from the seed of the request on, and draw it.

        1 if a point failed, else 0; UsageError for options that only a single run has.
        """
        if request.video or request.overwrite:
            raise UsageError(
                f"figure '{request.experiment}' is a sweep, which goes on with what is in --out; "
                "leave out --video and --overwrite"
            )
        return sweep.run(
            sweep.Request(
                experiment=self.experiment,
                vary=list(self.vary),
                seeds=tuple(range(request.seed, request.seed + self.n_seeds)),
                backend=request.backend,
                chip=request.chip,
                passes=request.passes,
                seconds=self.seconds if request.seconds is None else request.seconds,
                settings=_replaced(self.settings, request.settings),
                out=request.out,
                workers=workers.n or os.cpu_count() or 1,
                scheduler=workers.scheduler,
                probes=self.probes,
                figure=self.figure,
            )
        )


def _replaced(papers: Mapping[str, str], given: Sequence[str]) -> list[str]:
    """The paper's settings, but for those that are given, and these."""
    keys = {pair.partition("=")[0] for pair in given}
    return [*(f"{key}={value}" for key, value in papers.items() if key not in keys), *given]


WALK_S = 40.0
SWEEP_S = 20.0
"""Five of the six turns of the paper's path."""

FIGURES: dict[str, PaperFigure | PaperSweep] = {
    "reach": PaperFigure("Fig. 4: reach-to-target", "reach", 15.0, {"preset": "paper"}),
    "draw": PaperFigure("Fig. 5: a digit", "draw", 12.0, {"preset": "paper", "digit": "5"}),
    "walk": PaperSweep(
        "Fig. 6a: reference policy and spiking policy",
        "walk",
        WALK_S,
        {"path": "paper"},
        ["policy=mlp,spiking"],
        5,
        "spikeport.experiments.walk.trajectories",
        probes=True,
    ),
    "walk-sweep": PaperSweep(
        "Fig. 6b: neurons of a unit, and filters between layers",
        "walk",
        SWEEP_S,
        {"path": "paper", "calibrated": "false"},
        ["n_neurons=2,6,20,40", "tau_fwd=.001,.002,.005,.01", "backend=reference,native"],
        5,
        "spikeport.experiments.walk.sweep_figure",
    ),
    "walk-silenced": PaperFigure(
        "Fig. 6c: half of the ensembles fall silent",
        "walk",
        WALK_S,
        {"path": "paper", "silence": "0.5", "silence_at": "25"},
    ),
}


def figure(request: run.Request, workers: Workers) -> int:
    """Make a figure as the paper does, but for what the request says otherwise.

    1 if a point of a sweep failed, else 0.

    Raises
    ------
    UsageError
        If the paper has no figure of that name, or as `spikeport.commands.run.run`.
    """
    if request.experiment not in FIGURES:
        raise unknown("figure", request.experiment, FIGURES)
    return FIGURES[request.experiment].make(request, workers)
