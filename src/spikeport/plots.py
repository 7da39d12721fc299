"""Functions for all figures: a text that is drawn as it is, a figure as the content of a file."""

from io import BytesIO
from typing import TYPE_CHECKING

from spikeport.errors import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plain(text: str) -> str:
    """Return a text, as of a label, such that matplotlib draws it and reads no formula in it."""
    return printable(text, kept="\n").replace("$", r"\$")


def rendered(figure: "Figure") -> bytes:
    """Return a figure as the content of a PNG file."""
    content = BytesIO()
    figure.savefig(content, dpi=110, format="png")
    return content.getvalue()
