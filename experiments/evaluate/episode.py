"""One episode of an evaluation, in whatever process it is run."""

import dataclasses
import warnings

from spikeport.experiments.evaluate.measures import measure
from spikeport.experiments.evaluate.walker import find_walker
from spikeport.experiments.sweep.folder import PointFiles
from spikeport.experiments.sweep.plan import Point
from spikeport.experiments.walk.settings import WalkSettings


def run_episode(point: Point, _scratch: str) -> PointFiles:
    """Walk an episode, and return what is kept of it."""
    settings, options = WalkSettings(**point.settings), point.options
    with warnings.catch_warnings(action="ignore"):
        walker = find_walker(settings, options)
        stage = walker.walk(settings.perturbation, options.seconds, options.seed)
    return PointFiles(
        {
            "experiment": point.sweep.experiment,
            "backend": options.backend,
            "seconds": options.seconds,
            "seeds": {"run": options.seed, "network": settings.network_seed},
            "settings": dataclasses.asdict(settings),
            "metrics": measure(stage),
        },
        None,
    )
