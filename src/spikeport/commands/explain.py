"""``spikeport compile --explain SP101``."""

from collections.abc import Iterator

from spikeport.commands.console import Console, ScreenTable
from spikeport.compile.check import rules
from spikeport.compile.check.rules import GROUPS, Rule


def explain(rule_id: str) -> None:
    """Print a rule with its meaning, limit, reason, source and cures."""
    rule = rules.get(rule_id)
    entries = ScreenTable.grid("", "", padding=(0, 1))
    for name, text in named(rule):
        entries.add_row(f"  {name}:", text)
    console = Console(highlight=False)
    console.print(f"{rule.id} {rule.name} ({GROUPS[rule.id[:3]].lower()})")
    console.print(entries)


def named(rule: Rule) -> Iterator[tuple[str, str]]:
    """Yield the texts that explain a rule, each with its name."""
    yield "means", rule.meaning
    if rule.limit:
        yield "limit", rule.limit
    yield "why", rule.reason
    yield "source", rule.source
    yield from (("cure", cure) for cure in rule.cures)
