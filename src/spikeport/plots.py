"""Functions for all figures: the escaping of labels, and rendering as PNG."""

from io import BytesIO
from typing import TYPE_CHECKING

from spikeport.errors import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plain(text: str) -> str:
    """Return a text, e.g. a label, escaped so that matplotlib reads no formula in it."""
    return printable(text, kept="\n").replace("$", r"\$")


def rendered(figure: "Figure") -> bytes:
    """Return a figure as the content of a PNG file."""
    content = BytesIO()
    figure.savefig(content, dpi=110, format="png")
    return content.getvalue()
