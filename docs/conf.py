"""The site: Sphinx reads the Markdown of this folder, which reads well on a code host, too.

`make docs` builds it. Nothing is fetched, at build time or by a reader's browser.
"""

import logging
import os
import re
import sys
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode, math, math_block
from docutils.utils.math.latex2mathml import tex2mathml
from jupyter_client.manager import KernelManager
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent / "src"))
os.environ.setdefault("PYTHONPATH", str(DOCS.parent / "src"))  # for the kernels of notebooks

import spikeport  # noqa: E402

OWN_ROBOT = "examples/own_robot.py"  # a program, not a notebook

project = "spikeport"
version = release = spikeport.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "index"
exclude_patterns = ["conf.py", OWN_ROBOT, "**/__pycache__", "**/.ipynb_checkpoints"]
source_suffix = {".md": "myst-nb", ".py": "myst-nb"}

html_theme = "furo"
html_title = f"spikeport {release}"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
myst_update_mathjax = False
html_math_renderer = "mathml"

nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "cache"
nb_execution_cache_path = str(DOCS.parent / "build" / "notebooks")
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True
nb_ipywidgets_js: dict[str, Any] = {}
# Other users of this machine can reach a kernel's port: ipykernel 7 warns unless it is encrypted.
if hasattr(KernelManager, "transport_encryption"):
    KernelManager.transport_encryption.default_value = "auto"
# One of furo's packages has every logger print, nbclient's among them.
logging.getLogger("traitlets").setLevel(logging.WARNING)

autodoc_typehints = "description"
autodoc_member_order = "bysource"


def adapt(_app: Sphinx, page: str, source: list[str]) -> None:
    """Adapt a page that was written for a code host: links to code, the list of contents."""
    if page == "index":
        source[0] = PART.sub(_toctree, source[0])
    elif not page.startswith("examples/"):
        source[0] = TO_CODE.sub(_link, source[0])


TO_CODE = re.compile(r"\[([^]]+)\]\(((?:\.\./)+)([\w/]+)\.py\)")
PART = re.compile(r"^## (.*)\n\n((?:- \[.*\n)+)", re.MULTILINE)


def _link(link: re.Match[str]) -> str:
    text, up, path = link.groups()
    # Notebooks lie beside docs/, and in it by a link, which code hosts do not follow.
    if path.startswith("examples/") and f"{path}.py" != OWN_ROBOT:
        return f"{{doc}}`{text} </{path}>`"
    return f"[{text}](path:{up}{path}.py)"


def _toctree(part: re.Match[str]) -> str:
    """Return a part of the contents: its list, and the same for the bar at the side."""
    pages = re.findall(r"^- \[(.*?)\]\((?:\.\./)?(.*?)\.(?:md|py)\)", part[2], re.MULTILINE)
    listed = "\n".join(f"- {{doc}}`{title} </{path}>`" for title, path in pages)
    lines = "\n".join(f"{title} <{path}>" for title, path in pages)
    tree = f"```{{toctree}}\n:hidden:\n:caption: {part[1]}\n\n{lines}\n```"
    return f"## {part[1]}\n\n{listed}\n\n{tree}\n"


def inline(translator: HTML5Translator, node: math) -> None:
    """Write an equation in a line as MathML, which browsers draw by themselves."""
    translator.body.append(tex2mathml(node.astext()))
    raise SkipNode


def block(translator: HTML5Translator, node: math_block) -> None:
    """Write an equation of its own as MathML."""
    translator.body.append(tex2mathml(node.astext(), as_block=True))
    raise SkipNode


def setup(app: Sphinx) -> None:
    """Add the renderer of equations, and what adapts pages."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    app.connect("source-read", adapt)
