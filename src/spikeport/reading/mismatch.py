"""The refusal of a file that does not hold what it should, before its path is known."""

from spikeport.errors import printable

SHOWN = 400
"""Most characters of a file's contents that a message shows."""


class MismatchError(Exception):
    """A file does not hold what it should; its reader makes an error of it that names the file.

    ``cure`` is one that is better than the reader's.
    """

    def __init__(self, expected: str, found: str, cure: str | None = None) -> None:
        super().__init__(f"expected {shown(expected)}, found {shown(found)}")
        self.cure = cure


def shown(value: object) -> str:
    """Return a value as a line: those out of a file may hold anything, and be of any length."""
    text = str(value)
    return printable(text if len(text) <= SHOWN else f"{text[:SHOWN]}...")
