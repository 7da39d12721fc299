"""Documents that are made from data: ``python -m spikeport.documents docs`` writes them.

``rules.md`` is the table of rules, ``report.schema.json`` the schema of reports. Tests hold the
files to what is written here.
"""

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from spikeport.atomic import write_text
from spikeport.compile.check.rules import GROUPS, RULES, Rule
from spikeport.compile.report.schema import schema

HEAD = """# Rules

Every rule `spikeport compile` checks, with the id its messages carry. `spikeport compile --explain
SP101` prints one of them. SP0xx to SP2xx are refused; SP3xx end a compile with exit code 1; SP4xx
are hints; SP5xx are refused on this machine. Made from `compile/check/rules.toml` by `python -m
spikeport.documents docs`."""


def rules() -> str:
    """The table of rules, as Markdown."""
    parts = [HEAD]
    for prefix, title in GROUPS.items():
        parts.append(f"## {prefix}xx: {title.lower()}")
        parts += ["\n".join(_rule(rule)) for rule in RULES.values() if rule.id.startswith(prefix)]
    return "\n\n".join(parts) + "\n"


def _rule(rule: Rule) -> Iterator[str]:
    yield f"### {rule.id} {rule.name}\n\n{rule.meaning} {rule.reason} ({rule.source})\n"
    if rule.limit:
        yield f"- limit: {rule.limit}"
    for cure in (rule.cure, *rule.more):
        yield f"- cure: {cure.replace('{parts}', 'n')}"


def report_schema() -> str:
    """The JSON Schema of reports."""
    return json.dumps(schema(), indent=2) + "\n"


DOCUMENTS: dict[str, Callable[[], str]] = {"rules.md": rules, "report.schema.json": report_schema}


def main(folder: Path) -> None:
    """Write every document into a folder."""
    for name, make in DOCUMENTS.items():
        write_text(folder / name, make())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
