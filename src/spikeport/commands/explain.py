"""``spikeport compile --explain SP101``."""

from collections.abc import Iterator

from rich.console import Console

from spikeport.compile.check import rules
from spikeport.compile.check.rules import GROUPS, Rule


def explain(rule_id: str) -> None:
    """Print all there is to know about a rule."""
    console = Console(highlight=False)
    for line in lines(rules.get(rule_id)):
        console.print(line, markup=False)


def lines(rule: Rule) -> Iterator[str]:
    """Yield the lines that explain a rule."""
    yield f"{rule.id} {rule.name} ({GROUPS[rule.id[:3]].lower()})"
    yield f"  means:  {rule.meaning}"
    if rule.limit:
        yield f"  limit:  {rule.limit}"
    yield f"  why:    {rule.reason}"
    yield f"  source: {rule.source}"
    for cure in (rule.cure, *rule.more):
        yield f"  cure:   {cure.replace('{parts}', 'n')}"
