"""The plan of a sweep: an experiment at all combinations of some settings, from several seeds."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple
from urllib.parse import quote

from spikeport.cache import COMPUTING, own_version
from spikeport.digest import digest_of
from spikeport.experiments import registry
from spikeport.experiments.options import Options
from spikeport.extras import version_of

SEED = "seed"
BACKEND = "backend"
LONGEST_NAME, KEPT = 235, 150
"""The longest name of a point, and the letters that are kept of a longer one. Names in file systems
have up to 255 bytes, of which an ending and the ending of a half-written file take 20."""

_COMPUTING_TOO = ("nengo-spa", "scikit-learn")
"""Packages that no image and no cached result depends on, but figures: weights of an action
selection, and the digit that a drawing is read as."""


def computing_versions() -> dict[str, str | None]:
    """Return the versions of the packages that compute: others may have other results."""
    return {name: version_of(name) for name in (*COMPUTING, *_COMPUTING_TOO)}


@dataclass(frozen=True)
class Sweep:
    """The plan of a sweep.

    Attributes
    ----------
    experiment : str
        The experiment's name, see `spikeport.experiments.registry`.
    backend, chip, pipeline, seconds
        As in `spikeport.experiments.options.Options`.
    settings : mapping
        Settings of all points.
    varied : mapping
        The values of each setting that differs from point to point; ``backend`` can be one.
    seeds : tuple of int
        Seeds of the run, and of the network where ``network_seed`` is neither set nor varied.
    probes : bool
        True if the time series of each point are kept, too.
    files : mapping
        A digest of each file that settings or chip name, as it was when the sweep began; see
        `spikeport.experiments.sweep.inputs`.
    spikeport : str
        The version and the code of spikeport that its points are run by.
    versions : mapping
        The versions of the packages that compute.
    """

    kind: ClassVar[str] = "sweep"
    """The word for such a plan, in messages and in the name of its folder."""

    experiment: str
    backend: str
    chip: str
    pipeline: str | None
    seconds: float
    settings: Mapping[str, Any]
    varied: Mapping[str, tuple[Any, ...]]
    seeds: tuple[int, ...]
    probes: bool = False
    files: Mapping[str, str] = field(default_factory=dict)
    spikeport: str = field(default_factory=own_version)
    versions: Mapping[str, str | None] = field(default_factory=computing_versions)

    @property
    def axes(self) -> dict[str, tuple[Any, ...]]:
        """The settings in which its points differ, with all values, and the seed."""
        return {**self.varied, SEED: self.seeds}

    def points(self) -> list["Point"]:
        """Return all points, seed by seed, so that the first results cover all settings."""
        *varied, seeds = self.axes.values()
        return [
            Point(self, dict(zip(self.axes, (*values, seed), strict=True)))
            for seed in seeds
            for values in itertools.product(*varied)
        ]

    def of_a_seed(self) -> "list[Point]":
        """Return the points of the first seed, which cover all settings other than seeds."""
        return replace(self, seeds=self.seeds[:1]).points()

    @property
    def lasts(self) -> list[float]:
        """The simulated times of its points, without duplicates: several if schedules vary."""
        return sorted({point.seconds for point in self.of_a_seed()})


class Point(NamedTuple):
    """One run of a sweep; ``place`` is its value on each of the sweep's axes."""

    sweep: Sweep
    place: Mapping[str, Any]

    @property
    def name(self) -> str:
        """The name of its file; a name that would be too long is cut, and ends with a digest."""
        name = ",".join(f"{key}={_quoted(value)}" for key, value in self.place.items())
        if len(name) <= LONGEST_NAME:
            return name
        return f"{name[:KEPT]}-{digest_of(self.place)[:16]}"

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of its experiment."""
        varied = {k: v for k, v in self.place.items() if k not in (SEED, BACKEND)}
        # A seed that the user set, or varies, wins over the point's own.
        return {"network_seed": self.place[SEED], **self.sweep.settings, **varied}

    @property
    def options(self) -> Options:
        """The options of its run."""
        sweep = self.sweep
        return Options(
            seconds=sweep.seconds,
            backend=self.place.get(BACKEND, sweep.backend),
            chip=sweep.chip,
            pipeline=sweep.pipeline,
            seed=self.place[SEED],
        )

    @property
    def seconds(self) -> float:
        """The simulated time of its run: the sweep's, or the time of a shorter schedule."""
        experiment = registry.get(self.sweep.experiment)
        if experiment.lasts is None:
            return self.sweep.seconds
        return experiment.lasts(experiment.settings(**self.settings), self.sweep.seconds)

    @property
    def network(self) -> str:
        """A text that is the same for all points of the sweep with the same network."""
        of_run = registry.get(self.sweep.experiment).of_run
        deciding = {key: value for key, value in self.settings.items() if key not in of_run}
        return digest_of((self.options.backend, deciding))


def _quoted(value: object) -> str:
    """Return a value as part of a file's name; names of files need not be UTF-8."""
    return quote(str(value), safe="", errors="surrogateescape")
