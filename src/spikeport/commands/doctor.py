"""``spikeport doctor``."""

import re
from importlib import metadata

from spikeport.commands.console import Console, ScreenTable
from spikeport.extras import install_command, version_of

DEVELOPMENT = ("test", "check", "referee")
"""Extras that a user does not need."""


def packages() -> dict[str, str]:
    """Return the extra of each package that spikeport asks for, by name; empty if it is required.

    Source: the metadata of the installed spikeport, and so pyproject.toml.
    """
    found: dict[str, str] = {}
    for line in metadata.requires("spikeport") or ():
        # By hand: we do not depend on the package `packaging`, which reads such lines.
        name = re.match(r"[\w.-]+", line)
        extra = re.search(r"extra == .([\w-]+)", line)
        mine = extra[1] if extra else ""
        if name and name[0] != "spikeport" and mine not in DEVELOPMENT:
            # Any one of several extras installs it.
            found.setdefault(name[0], mine)
    return found


def run() -> int:
    """Print installed and missing packages; return 1 if a required one is missing, else 0."""
    table = ScreenTable("part", "found", "if missing")
    wanted = packages()
    missing = [name for name in wanted if not version_of(name)]
    for name, extra in wanted.items():
        cure = f"extra {extra}" if extra else "required"
        table.add_row(name, version_of(name) or "missing", cure if name in missing else "")
    graphics, cure = _graphics() if "mujoco" not in missing else ("needs mujoco", "")
    table.add_row("pictures (OpenGL)", graphics, cure)
    Console().print(table)
    if missing:
        extras = ",".join(sorted({wanted[name] for name in missing} - {""}))
        print(f"to install everything that is missing: {install_command(extras)}")
    return int(any(not wanted[name] for name in missing))


def _graphics() -> tuple[str, str]:
    from spikeport.errors import MissingExtraError, RenderError

    try:
        from spikeport.robot.description import load
        from spikeport.robot.render import Renderer

        with Renderer(load(), 64, 48):
            return "works", ""
    except (RenderError, MissingExtraError) as error:
        return "missing", str(error)
