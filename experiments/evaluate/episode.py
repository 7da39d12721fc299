"""One episode of an evaluation, run in any process."""

import warnings
from dataclasses import asdict, dataclass, replace

from spikeport.experiments.evaluate.measures import measure
from spikeport.experiments.evaluate.walker import WALKERS, find_walker
from spikeport.experiments.sweep.folder import PointFiles
from spikeport.experiments.sweep.plan import Point
from spikeport.experiments.sweep.store import Sharing
from spikeport.experiments.walk.settings import WalkSettings


@dataclass(frozen=True)
class EpisodeRun(Sharing):
    """The runner of an evaluation's episodes."""

    def __call__(self, point: Point, scratch: str) -> PointFiles:
        """Walk an episode, and return the files that are kept of it."""
        settings = WalkSettings(**point.settings)
        options = replace(point.options, cache=self.store(scratch))
        with warnings.catch_warnings(action="ignore"), WALKERS.dropped_on_error():
            walker = find_walker(settings, options)
            stage = walker.walk(settings.perturbation, options.seconds, options.seed)
        return PointFiles(
            {
                "experiment": point.sweep.experiment,
                "backend": options.backend,
                "seconds": options.seconds,
                "seeds": {"run": options.seed, "network": settings.network_seed},
                "settings": asdict(settings),
                "metrics": measure(stage),
            },
            None,
        )
