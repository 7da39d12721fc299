"""Documents that are made from data: ``python -m spikeport.documents docs`` writes them.

``rules.md`` is the table of rules, ``report.schema.json`` the schema of reports, ``commands.md``
the help of every command, ``settings.md`` the settings of every experiment. Tests check that the
files are up to date.
"""

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from typer.main import get_command

from spikeport import settings_page
from spikeport.atomic import write_text
from spikeport.cli import app
from spikeport.compile.check.rules import GROUPS, RULES, Rule
from spikeport.compile.report.schema import schema

HEAD = """# Rules

These are the rules that `spikeport compile` checks. Messages contain the id of a rule, which
`spikeport compile --explain SP101` explains.

| ids | |
|---|---|
| SP0xx to SP2xx | the network is refused; for SP001 alone, all of it runs on the host instead |
| SP3xx | the network exceeds your own budget: exit code 1 |
| SP4xx | a hint: the network compiles, but something is lost or left out |
| SP5xx | the network is refused on this machine |

A *block* is the neurons of an ensemble, of a relay or of a read-out, as they lie on a core. A
*relay* decodes the values of one ensemble and sends them on to another as spikes; the host
reads the voltages of a *read-out* as values. An *axon* is an entry in a core's table of sources
or targets, a *profile* a set of constants that compartments or synapses share. A *passthrough
node* is a node without a function.

This page is made from `compile/check/rules.toml` by `python -m spikeport.documents docs`."""


COMMANDS_HEAD = """# Command line

This page lists all commands with their arguments and options, as `--help` does; `spikeport
--version` prints the version.

| exit code | meaning |
|---|---|
| 0 | done; also a server that Ctrl-C or a signal ended |
| 1 | the network does not fit, something failed, a function of yours raised an error (one that \
makes the network, a node's or a connection's), or a check or comparison found a difference |
| 2 | the command was used wrongly, an extra is missing, or a file is absent, cannot be imported \
or is refused |
| 130 | interrupted by Ctrl-C; `sweep`, `evaluate` and `train` also by SIGTERM |
| 128 + n | ended by signal n |

This page is made from the commands by `python -m spikeport.documents docs`."""


def rules() -> str:
    """Return the table of rules, as Markdown."""
    parts = [HEAD]
    for prefix, title in GROUPS.items():
        parts.append(f"## {prefix}xx: {title.lower()}")
        parts += ["\n".join(_rule(rule)) for rule in RULES.values() if rule.id.startswith(prefix)]
    return "\n\n".join(parts) + "\n"


def _rule(rule: Rule) -> Iterator[str]:
    yield f"### {rule.id} {rule.name}\n\n{rule.meaning} {rule.reason} ({rule.source})\n"
    if rule.limit:
        yield f"- limit: {rule.limit}"
    yield from (f"- cure: {cure}" for cure in rule.cures)


def report_schema() -> str:
    """Return the JSON Schema of reports."""
    return json.dumps(schema(), indent=2) + "\n"


def commands() -> str:
    """Return the help of every command, as Markdown."""
    root = get_command(app)
    return "\n\n".join([COMMANDS_HEAD, *_commands("spikeport", root)]) + "\n"


def _commands(path: str, command: Any) -> Iterator[str]:
    for name, one in getattr(command, "commands", {}).items():
        if hasattr(one, "commands"):
            yield from _commands(f"{path} {name}", one)
            continue
        usage = [_argument(row) for row in one.params if row.param_type_name == "argument"]
        yield f"## {' '.join((path, name))}\n\n    {' '.join((path, name, *usage))} [OPTIONS]"
        yield " ".join(one.help.split())
        if rows := [_row(row) for row in one.params if not row.hidden]:
            yield "\n".join(("| | | default |", "|---|---|---|", *rows))


def _argument(row: Any) -> str:
    name = row.metavar or row.name.upper()
    return name if row.required else f"[{name}]"


def _row(row: Any) -> str:
    names = " or ".join(f"`{name}`" for name in (*row.opts, *row.secondary_opts))
    if row.param_type_name == "argument":
        names = f"`{_argument(row)}`"
    elif row.metavar:
        names += f" `{row.metavar}`"
    plain = isinstance(row.default, str | int | float | Path) and not isinstance(row.default, bool)
    default = f"`{row.default}`" if plain and row.default != "" else ""
    if row.secondary_opts:  # a pair, one of which holds without either
        default = f"`{(row.opts if row.default else row.secondary_opts)[0]}`"
    if row.required and row.param_type_name == "option":  # its name cannot mark it with brackets
        default = "required"
    text = " ".join((row.help or "").split()).replace("|", "\\|")  # a bar would end the cell
    return f"| {names} | {text} | {default} |"


DOCUMENTS: dict[str, Callable[[], str]] = {
    "rules.md": rules,
    "report.schema.json": report_schema,
    "commands.md": commands,
    "settings.md": settings_page.page,
}


def main(folder: Path) -> None:
    """Write every document into a folder."""
    for name, make in DOCUMENTS.items():
        write_text(folder / name, make())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
