"""A report in short: its resources as a table, its hints in a line, its verdict."""

import html
import textwrap
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

from spikeport.counted import counted, in_kib
from spikeport.hardware_models.limits import Usage, limits_of_a_core
from spikeport.hardware_models.topology import chips_used
from spikeport.table import Table

if TYPE_CHECKING:
    from spikeport.compile.report.report import Report

WIDTH = 79


def resources(report: "Report") -> Table:
    """Return every resource: the chip's sum, and the core that uses most of it."""
    whole = "whole chip" if report.chip.limits.chips.count == 1 else "whole board"
    fullest, labels = report.fullest(), [core.label for core in report.cores]
    rows = []
    for name, total in report.resources().items():
        if name == "chips" and total.limit == 1:
            continue
        one = fullest.get(name)
        # Cores, chips and memory that cores share are used by the whole chip.
        if one is None or name not in limits_of_a_core(report.chip):
            core = ("", "", "")
        else:
            core = (*_share(one), str(labels.index(one.object)))
        rows.append((name.replace("_", " "), *_share(total), *core))
    header = ("used / limit", whole, "%", "fullest", "%", "core")
    return Table(f"{report.chip.title}: {cores_in_words(report)}", header, tuple(rows))


def cores_in_words(report: "Report") -> str:
    """Return the number of cores, and of chips if there are several, in words."""
    cores = counted(len(report.cores), "core")
    chips = chips_used(len(report.cores), report.chip)
    return cores if chips <= 1 else f"{cores} of {chips} chips"


def verdict(report: "Report") -> str:
    """Return the last line: if the network fits, on how many cores, and the image's digest."""
    if report.violations:
        # A builder's own refusal breaks none of our rules.
        rules = sorted({violation.id for violation in report.violations} - {""})
        why = f"breaks {', '.join(rules)}" if rules else "its builder refuses it"
        return f"does not fit chip '{report.chip.name}': {why}"
    if not report.digest:
        return "no part of the network is on the chip: all of it runs on the host"
    unknown = [name for name, usage in report.resources().items() if usage.limit is None]
    parts = [f"fits chip '{report.chip.name}' on {cores_in_words(report)}"]
    if "cores" in report.lower_bound:
        parts[0] += f" (lower bound {report.lower_bound['cores']})"
    if report.chip.synapse_memory is None and report.chip.soft_memory is None:
        unknown.append("layout of synapse memory")
    if unknown:
        names = ", ".join(name.replace("_", " ") for name in unknown)
        parts.append(f"not public, not checked: {names}")
    if report.chip.caveat:
        parts.append(report.chip.caveat)
    return "; ".join([*parts, f"image {report.digest[:16]}"])


def text(report: "Report") -> str:
    """Return the report on one screen of 80 columns."""
    lines = (line for one in _lines(report) for line in textwrap.wrap(one, WIDTH))
    return "\n".join([str(resources(report)), *lines])


def as_html(report: "Report") -> str:
    """Return the report as HTML, for notebooks."""
    lines = "".join(f"<div>{html.escape(one)}</div>" for one in _lines(report))
    return resources(report).html() + lines


def _lines(report: "Report") -> Iterator[str]:
    if report.hints:
        by_rule = Counter(f"{hint.id} {hint.rule}" for hint in report.hints)
        named = ", ".join(f"{rule} ({n}x)" if n > 1 else rule for rule, n in by_rule.items())
        yield f"hints, in full in report.hints: {named}"
    yield verdict(report)


def _share(usage: Usage) -> tuple[str, str]:
    amount, unit = (in_kib, " KiB") if usage.unit == "bit" else ("{:,.0f}".format, "")
    if usage.limit is None:
        return f"{amount(usage.used)}{unit} / not public", ""
    amounts = f"{amount(usage.used)} / {amount(usage.limit)}{unit}"
    return amounts, f"{100 * usage.used / usage.limit:.1f}"
