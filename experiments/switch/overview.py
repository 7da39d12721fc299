"""The paper's overview of the whole system, drawn from the network itself.

Boxes are the parts of a network with their populations and neurons, and arrows are its connections
between parts. Dashed arrows bring the robot's state, as in the paper.
"""

import re
from collections.abc import Iterator, Mapping

import nengo
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch
from nengo.base import NengoObject, ObjView
from nengo.ensemble import Neurons

from spikeport.networks.humanoid import HumanoidNetwork

ROBOT = "robot"
PLACES = {
    "selection": (0.5, 0.83, "#8d6e63"),
    "arm": (0.2, 0.45, "#1f77b4"),
    "follower": (0.53, 0.45, "#2e7d32"),
    "policy": (0.85, 0.45, "#2e7d32"),
    ROBOT: (0.5, 0.09, "#44474d"),
}
"""Place and colour of each part: basal ganglia brown, arm blue, walking green, as in the paper."""
WIDTH, LINE = 0.27, 0.032

Populations = Mapping[str, int]
"""Neurons of each population, by name."""
Arrow = tuple[str, str]
"""A part, and another part that it sends values to."""


def populations(part: nengo.Network) -> Populations:
    """Return the neurons of a part's populations; ensembles with numbered names are one."""
    found: dict[str, int] = {}
    for ensemble in part.all_ensembles:
        # Numbered ensembles, such as the units of a layer, are one population; strD1 is a name.
        name = re.sub(r"\s+\d+", "", str(ensemble.label))
        found[name] = found.get(name, 0) + ensemble.n_neurons
    return found


def arrows(network: nengo.Network, parts: Mapping[str, nengo.Network]) -> list[Arrow]:
    """Return the pairs of parts with a connection from the first to the second."""
    # By identity: Nengo's objects compare by more than that.
    owner = {id(obj): name for name, part in parts.items() for obj in _objects(part)}
    ends = (
        (owner.get(id(_whole(one.pre_obj))), owner.get(id(_whole(one.post_obj))))
        for one in network.all_connections
    )
    return sorted({(a, b) for a, b in ends if a is not None and b is not None and a != b})


def _objects(part: nengo.Network) -> Iterator[NengoObject]:
    yield from part.all_ensembles
    yield from part.all_nodes


def _whole(obj: NengoObject | ObjView | Neurons) -> NengoObject:
    """Return the ensemble or node that a view, or neurons, belong to."""
    whole = obj.obj if isinstance(obj, ObjView) else obj
    return whole.ensemble if isinstance(whole, Neurons) else whole


def overview_figure(network: nengo.Network) -> Figure:
    """Draw the parts of the humanoid in a network, their neurons and their connections."""
    (humanoid,) = (one for one in network.all_networks if isinstance(one, HumanoidNetwork))
    parts = {name: getattr(humanoid, name) for name in PLACES if name != ROBOT}
    figure = Figure(figsize=(12, 9))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.axis("off")
    heights = {name: _draw_part(axes, name, populations(part)) for name, part in parts.items()}
    heights[ROBOT] = _draw_part(axes, ROBOT, {})
    for pre, post in arrows(humanoid, parts):
        _draw_arrow(axes, heights, (pre, post), "-")
    for part in ("arm", "follower", "policy"):
        _draw_arrow(axes, heights, (ROBOT, part), "--")
    for part in ("arm", "follower", "policy"):
        _draw_arrow(axes, heights, (part, ROBOT), "-")
    return figure


def _draw_part(axes: Axes, name: str, held: Populations) -> float:
    """Draw a part with its populations, and return half of its height."""
    x, y, colour = PLACES[name]
    total = sum(held.values())
    title = f"{name}: {total:,} neurons" if held else name
    half = (len(held) + 2) * LINE / 2
    box = FancyBboxPatch(
        (x - WIDTH / 2, y - half),
        WIDTH,
        2 * half,
        boxstyle="round,pad=0.005",
        fc="white",
        ec=colour,
    )
    axes.add_patch(box)
    rows = [f"{population}: {n:,}" for population, n in held.items()]
    for i, text in enumerate([title, *rows]):
        weight = "bold" if i == 0 else "normal"
        at = y + half - (i + 1) * LINE
        axes.text(x, at, text, ha="center", va="center", color=colour, weight=weight, size=9)
    return half


def _draw_arrow(axes: Axes, heights: Mapping[str, float], arrow: Arrow, style: str) -> None:
    (x0, y0, colour), (x1, y1, _) = (PLACES[name] for name in arrow)
    # Arrows there and back do not lie on each other.
    aside = 0.015 if style == "-" else -0.015
    level = abs(y0 - y1) < LINE
    if level:
        begin = x0 + (WIDTH / 2 if x1 > x0 else -WIDTH / 2), y0 + aside
        end = x1 + (-WIDTH / 2 if x1 > x0 else WIDTH / 2), y1 + aside
    else:
        down = 1 if y1 < y0 else -1
        begin = x0 + aside, y0 - down * heights[arrow[0]]
        end = x1 + aside, y1 + down * heights[arrow[1]]
    look = {"arrowstyle": "->", "color": colour, "ls": style, "lw": 1.5}
    axes.annotate("", xy=end, xytext=begin, arrowprops=look)
