"""``spikeport cache``."""

import time

from spikeport import cache
from spikeport.commands.console import ScreenTable, line_console

BYTES_PER_MIB = 2**20
S_PER_DAY = 24 * 3600


def run(clear: bool) -> None:
    """Print the content of the user's cache, or remove it."""
    console, kept = line_console(), cache.of_user()
    if kept is cache.NOTHING:
        console.print(f"the cache is off: {cache.FOLDER}={cache.OFF}")
    elif clear:
        console.print(f"removed from {kept.folder}: {kept.clear()} entries")
    else:
        console.print(_table(kept))


def _table(kept: cache.Cache) -> ScreenTable:
    table = ScreenTable("kind", title=str(kept.folder))
    table.add_numbers("entries", "MiB", "newest, days")
    entries = kept.entries()
    for kind in sorted({entry.kind for entry in entries}):
        mine = [entry for entry in entries if entry.kind == kind]
        size = sum(entry.size for entry in mine) / BYTES_PER_MIB
        days = (time.time() - mine[-1].changed_s) / S_PER_DAY
        table.add_row(kind, str(len(mine)), f"{size:.1f}", f"{days:.1f}")
    return table
