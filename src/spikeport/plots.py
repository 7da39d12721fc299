"""Functions for all figures: the escaping of labels, legends, and rendering as PNG."""

from io import BytesIO
from typing import TYPE_CHECKING, Any

from spikeport.errors import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plain(text: str) -> str:
    """Return a text, e.g. a label, escaped so that matplotlib reads no formula in it."""
    return printable(text, kept="\n").replace("$", r"\$")


def rendered(figure: "Figure") -> bytes:
    """Return a figure as the content of a PNG file."""
    content = BytesIO()
    figure.savefig(content, dpi=110, format="png")
    return content.getvalue()


def legend_once(axes: "Axes", **options: Any) -> None:
    """Draw a legend with one entry for all lines of a label; options are those of ``legend``."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(once.values(), once.keys(), frameon=False, **options)
