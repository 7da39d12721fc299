"""Tables in Markdown: printed, or put between a file's markers."""

from collections.abc import Iterable, Sequence
from pathlib import Path

BEGIN, END = "<!-- benchmark -->", "<!-- /benchmark -->"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return heads and rows of equal length as a table."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows))


def insert(text: str, content: str) -> str:
    """Return the text with the content between its markers."""
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n{content}\n{END}{after}"


def show(content: str, into: Path | None) -> None:
    """Print the content, or write it between a file's markers."""
    if into is None:
        print(content)
    else:
        into.write_text(insert(into.read_text(encoding="utf-8"), content), encoding="utf-8")
