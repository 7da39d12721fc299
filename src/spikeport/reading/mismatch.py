"""The error for a file of unexpected content, raised where its path is not known."""

from spikeport.errors import printable

SHOWN = 400
"""Most characters of a file's content in a message."""


class MismatchError(Exception):
    """A file has unexpected content; its reader turns this into an error that names the file.

    ``cure`` replaces the reader's own cure in the message.
    """

    def __init__(self, expected: str, found: str, cure: str | None = None) -> None:
        super().__init__(f"expected {shown(expected)}, found {shown(found)}")
        self.expected, self.found, self.cure = expected, found, cure


def first_line(error: Exception) -> str:
    """Return the first line of an error's text; the name of its class if it has none."""
    return (str(error) or type(error).__name__).splitlines()[0]


def shown(value: object) -> str:
    """Return a value as a short line: a value from a file may hold anything, at any length."""
    text = str(value)
    return printable(text if len(text) <= SHOWN else f"{text[:SHOWN]}...")
