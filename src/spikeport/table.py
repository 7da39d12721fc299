"""Tables of texts, as lines for a screen and as HTML for a notebook."""

import html
from dataclasses import dataclass

GAP = "  "


@dataclass(frozen=True)
class Table:
    """A titled table; its first column is aligned left, all others right.

    Attributes
    ----------
    title : str
        The title.
    header : tuple of str
        The names of the columns.
    rows : tuple of tuples of str
        The rows, each as long as the header.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def __str__(self) -> str:
        """Return the table in lines of equal columns."""
        lines = [self.header, *self.rows]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join([self.title, *(_line(line, widths) for line in lines)])

    def html(self) -> str:
        """Return the table as HTML; its texts are escaped."""
        head = "".join(f"<th>{html.escape(text)}</th>" for text in self.header)
        body = "".join(_row(row) for row in self.rows)
        return (
            f"<table><caption>{html.escape(self.title)}</caption>"
            f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        )


def _line(texts: tuple[str, ...], widths: list[int]) -> str:
    first, *others = zip(texts, widths, strict=True)
    aligned = [first[0].ljust(first[1]), *(text.rjust(width) for text, width in others)]
    return GAP.join(aligned).rstrip()


def _row(texts: tuple[str, ...]) -> str:
    first, *others = map(html.escape, texts)
    cells = "".join(f'<td style="text-align: right">{text}</td>' for text in others)
    return f'<tr><th style="text-align: left">{first}</th>{cells}</tr>'
