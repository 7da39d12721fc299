"""The table and the lines on the errors of a conversion."""

from collections.abc import Iterator

from spikeport.commands.console import ScreenTable
from spikeport.experiments.policy.lint import ConversionLint


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
