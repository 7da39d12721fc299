"""A point of a sweep, run by a worker that keeps the network it made for the next point."""

import contextlib
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from spikeport.experiments import driver, registry, run_folder
from spikeport.experiments.digests import digests
from spikeport.experiments.driver import Ready
from spikeport.experiments.sweep.folder import PointFiles
from spikeport.experiments.sweep.keeper import Keeper
from spikeport.experiments.sweep.plan import Point
from spikeport.experiments.sweep.store import Sharing
from spikeport.experiments.trial import Trial
from spikeport.files import read_json


@dataclass(frozen=True)
class PointRun(Sharing):
    """The runner of a sweep's points."""

    def __call__(self, point: Point, scratch: str) -> PointFiles:
        """Run a point; its temporary files are in folders within ``scratch``."""
        options = replace(point.options, cache=self.store(scratch))
        experiment = registry.get(point.sweep.experiment)
        trial = experiment.trial(experiment.settings(**point.settings), options)
        with warnings.catch_warnings(action="ignore"), kept_if_whole():
            key = self.sweep, point.network
            ready = KEEPER.get(key, lambda: driver.prepare(trial))
            return _files(trial, ready, point.sweep.probes, scratch)


KEEPER: Keeper[Ready[Any]] = Keeper()
"""Keeps the loop of the last point for points with the same network."""


@contextlib.contextmanager
def kept_if_whole() -> Iterator[None]:
    """Keep the network prepared in the block, unless the block fails or a board is linked."""
    with KEEPER.dropped_on_error():
        yield
    # A board serves one session: the next point must be free to open its own.
    if KEEPER.kept is not None and KEEPER.kept.sim.link is not None:
        KEEPER.drop()


def _files(
    trial: Trial[Any, Any], ready: Ready[Any], keeps_probes: bool, scratch: str
) -> PointFiles:
    """Perform a trial, and return the files that are kept; no pictures or pages are made."""
    done = driver.perform(trial, ready)
    with tempfile.TemporaryDirectory(dir=scratch) as name:
        folder = Path(name)
        files = digests(trial.files)  # the same as before: `Unchanged` compares them
        run_folder.write_result(folder, driver.outcome(trial, ready, done, files).result)
        probes = None
        if keeps_probes:
            run_folder.write_probes(folder, driver.series(trial, ready.closed.rig, done))
            probes = (folder / "probes.nc").read_bytes()
        return PointFiles(read_json(folder / "result.json"), probes)
