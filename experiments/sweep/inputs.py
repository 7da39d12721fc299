"""A check that the files that a plan's points read do not change after the plan began.

The plan, and so ``sweep.json``, has digests of the files. A point compares them before it reads its
files, and once more when it is done. Otherwise, a file that changes meanwhile would leave results
from two contents side by side.
"""

import dataclasses
from pathlib import Path
from typing import TypeVar

from spikeport.cache import own_version
from spikeport.errors import UsageError
from spikeport.experiments import registry
from spikeport.experiments.digests import digest, digests
from spikeport.experiments.sweep.folder import PointFiles
from spikeport.experiments.sweep.plan import Point, Sweep
from spikeport.experiments.sweep.workers import Run
from spikeport.extras import version_of
from spikeport.hardware_models import chip as chips

S = TypeVar("S", bound=Sweep)
"""A plan of any kind."""


def files_of(point: Point) -> list[Path]:
    """Return the files that a point's settings and its chip name."""
    experiment = registry.get(point.sweep.experiment)
    found: list[Path] = experiment.settings(**point.settings).files
    return [*found, *chips.files_of(point.options.chip)]


def with_inputs(plan: S) -> S:
    """Return a plan with the digests of all files that its points read.

    Raises
    ------
    UsageError
        If one of them cannot be read.
    """
    named = {path for point in plan.of_a_seed() for path in files_of(point)}
    return dataclasses.replace(plan, files=digests(named))


def check(point: Point) -> None:
    """Refuse to go on with a point whose files or versions are not those of its plan.

    On a cluster these are the files and packages of the worker's machine.

    Raises
    ------
    UsageError
        If a version or a file differs, or a file cannot be read; the error names the first one.
    """
    _check_versions(point.sweep)
    held = point.sweep.files
    if not held:
        return
    # A changed schedule may name other files; the schedule itself is compared, too.
    for path in files_of(point):
        name = str(path)
        if name in held and (found := digest(path)) != held[name]:
            raise UsageError(
                f"{name}: changed since the {point.sweep.kind} began (digest {held[name]} then, "
                f"{found} now); put it back and give the same command again, or choose another "
                "--out"
            )


def _check_versions(plan: Sweep) -> None:
    """Refuse packages of other versions, or other code of ours, than where the plan was made."""
    begun = {"spikeport": plan.spikeport, **plan.versions}
    here = {"spikeport": own_version(), **{name: version_of(name) for name in plan.versions}}
    for name, version in begun.items():
        if here[name] != version:
            raise UsageError(
                f"{name} is {here[name]} in the worker, but {version} where the {plan.kind} began; "
                "cure: install the same version, or choose another --out if you changed it"
            )


@dataclasses.dataclass(frozen=True)
class Unchanged:
    """A runner of points in a worker, which refuses other files and versions than the plan's."""

    run: Run

    def __call__(self, point: Point, scratch: str) -> PointFiles:
        """Run a point; see `check` for what it refuses."""
        check(point)
        kept = self.run(point, scratch)
        check(point)
        return kept
