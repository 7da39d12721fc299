"""Tables in Markdown: printed, or put between a file's markers."""

import argparse
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


def document(text: str) -> Path:
    """Return the path of a file with both markers; ArgumentTypeError for another one."""
    path = Path(text)
    try:
        insert(path.read_text(encoding="utf-8"), "")
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        reason = f"has not one {BEGIN} and after it one {END}"
        raise argparse.ArgumentTypeError(f"{path}: {reason}") from error
    return path


def show(content: str, into: Path | None) -> None:
    """Print the content, and write it between a file's markers, whole or not at all."""
    print(content)
    if into is not None:
        part = into.with_name(f".{into.name}.part")
        part.write_text(insert(into.read_text(encoding="utf-8"), content), encoding="utf-8")
        part.replace(into)
