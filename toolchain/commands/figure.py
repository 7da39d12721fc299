"""``spikeport figure``: a figure of the paper, from a run with the paper's settings."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from spikeport.commands.run import Request, run
from spikeport.errors import unknown


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the paper: which, and the settings of the experiment that shows it."""

    summary: str
    seconds: float
    settings: Mapping[str, str]


FIGURES = {
    "reach": PaperFigure("Fig. 4: reach-to-target", 15.0, {"preset": "paper"}),
    "draw": PaperFigure("Fig. 5: drawing a digit", 12.0, {"preset": "paper", "digit": "5"}),
}
"""By the name of the experiment."""


def figure(request: Request) -> None:
    """Run the experiment as the paper does, but for what the request says otherwise.

    Raises
    ------
    UsageError
        If the paper has no figure of that name, or as `spikeport.commands.run.run`.
    """
    if request.experiment not in FIGURES:
        raise unknown("figure", request.experiment, FIGURES)
    paper = FIGURES[request.experiment]
    given = {pair.partition("=")[0] for pair in request.settings}
    rest = [f"{key}={value}" for key, value in paper.settings.items() if key not in given]
    seconds = paper.seconds if request.seconds is None else request.seconds
    run(replace(request, seconds=seconds, settings=[*rest, *request.settings]))
