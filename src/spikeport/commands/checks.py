"""Checks of options that commands share, before any work."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from spikeport.commands.options import Target
from spikeport.compile.passes.parse import parse
from spikeport.constants import DT_S, LARGEST_SEED, LONGEST_RUN
from spikeport.errors import UsageError
from spikeport.experiments.options import WITHOUT_NEURONS, Experiment, not_whole
from spikeport.hardware_models import chip as chips

if TYPE_CHECKING:
    from spikeport.experiments.trial import Trial

NO_CORES = (WITHOUT_NEURONS, "reference")
"""Backends without a chip."""


def check_target(target: Target) -> None:
    """Raise UsageError for an unknown chip or pass."""
    chips.get(target.chip)
    if target.passes is not None:
        parse(target.passes)


def check_needed(given: Iterable[str], trials: Sequence["Trial[Any, Any]"]) -> None:
    """Raise UsageError for a setting that does nothing in any of the trials."""
    unused = [trial.unused for trial in trials]
    for key in given:
        if all(key in one for one in unused):
            raise UsageError(f"{key}: does nothing {unused[0][key]}, or leave it out")


def check_counts(asked: bool, target: Target) -> None:
    """Raise UsageError if counts are asked for on a backend without cores."""
    if asked and target.backend in NO_CORES:
        raise UsageError(
            f"--counts: backend '{target.backend}' has no cores to count on; leave it out, or "
            "choose --backend native"
        )


def refuse_compile_options(target: Target, offload: bool = False) -> None:
    """Raise UsageError for options of a compile, on a backend for which nothing is compiled."""
    asked = {
        "--passes": target.passes is not None,
        "--offload": offload,
        "--chip": target.chip != Target.chip,
    }
    for option in (option for option, is_asked in asked.items() if is_asked):
        raise UsageError(
            f"{option}: for backend '{target.backend}' nothing is compiled; leave it out, or "
            "choose --backend native"
        )


def seconds_of(asked: float | None, experiment: Experiment) -> float:
    """Return the time to simulate; UsageError if it is too short, too long or no whole steps."""
    seconds = experiment.seconds if asked is None else asked
    if not experiment.shortest_s <= seconds <= LONGEST_RUN * DT_S:
        raise UsageError(
            f"--seconds {seconds:g}: {experiment.name} simulates at least "
            f"{experiment.shortest_s:g} s, and at most {LONGEST_RUN:,} steps of {DT_S:g} s"
        )
    check_whole_steps("--seconds", seconds)
    return seconds


def check_seconds(option: str, seconds: float) -> None:
    """Raise UsageError for an option that asks for a run of no steps, or of too many."""
    if not DT_S <= seconds <= LONGEST_RUN * DT_S:
        raise UsageError(
            f"{option} {seconds:g}: a run is at least one step of {DT_S:g} s, and at most "
            f"{LONGEST_RUN:,} steps"
        )
    check_whole_steps(option, seconds)


def check_whole_steps(option: str, seconds: float, dt_s: float = DT_S) -> None:
    """Raise UsageError for a time that a run of whole steps does not have."""
    if why := not_whole(seconds, dt_s):
        raise UsageError(f"{option} {seconds}: {why}")


def seeds_from(first: int, n: int, what: str) -> tuple[int, ...]:
    """Return ``n`` seeds in a row; see `check_seeds`."""
    check_seeds(first, n, what)
    return tuple(range(first, first + n))


def check_seeds(first: int, n: int, what: str) -> None:
    """Raise UsageError if the last of ``n`` seeds in a row is too large."""
    last = first + n - 1
    if last > LARGEST_SEED:
        raise UsageError(
            f"--seed {first}: the last of {n:,} {what} has seed {last}, limit {LARGEST_SEED}; "
            "cure: a smaller --seed"
        )
