"""The report on a conversion: its files beside those of the compile, its table and its lines."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from spikeport.commands.console import ScreenTable
from spikeport.errors import UsageError
from spikeport.experiments.policy.lint import ConversionLint
from spikeport.files import read_json, write_json
from spikeport.networks.walking_policy import WalkingPolicy

POLICY = "policy.npz"
"""The file of a walking policy, in the folder of its conversion."""
CONVERSION = "conversion.json"
"""The file of a conversion's errors in that folder."""
WALKER = "walking_policy"
"""Its key that is true if a walking policy was written beside it."""


def write_conversion(out: Path, lint: ConversionLint, walker: WalkingPolicy | None) -> None:
    """Write the errors of a conversion and a walking policy, in place of an earlier conversion."""
    if walker is not None:
        walker.save(out / POLICY)
    elif _wrote_policy(out / CONVERSION):  # otherwise the file is the user's own
        (out / POLICY).unlink(missing_ok=True)
    write_json(out / CONVERSION, {**asdict(lint), WALKER: walker is not None})


def _wrote_policy(conversion: Path) -> bool:
    """Return whether an earlier conversion wrote a walking policy beside this file."""
    try:
        held = read_json(conversion)
    except UsageError:
        return False
    return isinstance(held, dict) and held.get(WALKER) is True


def lint_table(lint: ConversionLint) -> ScreenTable:
    """Return the table of the conversion's errors, layer by layer."""
    table = ScreenTable("layer", title="conversion, in float spikes")
    table.add_numbers("units", "range", "/ rms", "rate Hz", "tau ms", "spikes", "error")
    for one in lint.layers:
        table.add_row(
            one.name,
            f"{one.n_units}",
            f"{0 - one.below:.2g} .. {one.above:.2g}",  # 0 has no sign then
            "-" if one.spread is None else f"{one.spread:.1f}",
            f"{one.rate_hz:.0f}",
            f"{1000 * one.tau_s:g}",
            f"{one.spikes:.2g}",
            _percent(one.error),
        )
    return table


def _percent(error: float | None) -> str:
    return "-" if error is None else f"{100 * error:.1f} %"


def lint_lines(lint: ConversionLint) -> Iterator[str]:
    """Yield the errors of the action, and hints on changes that may help."""
    in_float, on_chip = map(_percent, (lint.action_error, lint.chip_error))
    yield f"action: {in_float} off in float spikes, {on_chip} on the chip"
    for hint in lint.hints():
        yield f"hint: {hint}"
