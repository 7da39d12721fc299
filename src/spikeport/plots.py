"""What all figures have in common: texts that are no formulas, and their files."""

from io import BytesIO
from typing import TYPE_CHECKING

from spikeport.errors import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plain(text: str) -> str:
    """Return a text, as of a label, that matplotlib can draw, and takes for no formula."""
    return printable(text, kept="\n").replace("$", r"\$")


def rendered(figure: "Figure") -> bytes:
    """Return a figure as the content of a PNG file."""
    content = BytesIO()
    figure.savefig(content, dpi=110, format="png")
    return content.getvalue()
