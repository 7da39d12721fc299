"""`DecodePath`: a path for each decoded connection between ensembles on the chip."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import nengo
from pydantic import Field

from spikeport.compile.ground.filters import DECODE_TAU_S, asked_filter_s, time_constant_s
from spikeport.compile.ground.names import base
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import Scope, is_link
from spikeport.compile.ground.settings import NetworkSettings
from spikeport.compile.loihi.relay import RELAYS
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.passes.base import Context, NetworkPass
from spikeport.compile.passes.scale_rows import ScaleRows
from spikeport.compile.rewriting.decode_paths import (
    CROWDED,
    EPSILON_S,
    OTHER_FILTER,
    PathCost,
    Slack,
    all_but,
    chosen,
    pareto,
    path_costs,
    rejected,
)
from spikeport.compile.rewriting.direct_errors import DirectErrors
from spikeport.compile.rewriting.links import Link, link
from spikeport.compile.rewriting.rewire import rewire

PathChoice = Literal["auto", "direct", "onoff", "preset10", "host"]

Costs = dict[nengo.Connection, list[PathCost]]
"""The costs of all paths of each connection."""
Filters = dict[nengo.Ensemble, float]
"""The time constant of each target's compartments, in seconds."""


@dataclass(frozen=True)
class DecodePath(NetworkPass):
    """Wire decoded connections neuron to neuron, over decode neurons, or over the host.

    ``network.config[connection].decode_path`` (see `spikeport.add_params`) sets the path of a
    connection; if it is not set, ``default`` does. ``auto`` takes the path with the least error
    among those that need at most ``slack_cores`` cores more than the cheapest, and are at most
    ``slack_delay_s`` slower than decode neurons. The path over the host takes one step more, and
    traffic with the chip in every step.

    An ensemble has one filter for all its inputs, the slowest that an input asks for; a relay asks
    for 5 ms, since its spikes are noise without a filter. ``auto`` wires a connection directly only
    if this delays no other input by more than a relay would: 5 ms and a step. The other connections
    keep their own filter, in decode neurons. Nor does it wire more neurons to an ensemble than a
    core has input axons for.

    Attributes
    ----------
    default : str
        The path of connections for which none is set.
    slack_cores : float
        Cores that a lower error may cost.
    slack_delay_s : float
        Delay that a lower error may cost, in seconds.
    rate_hz : float
        The firing rate at which synaptic operations are counted.
    """

    name: ClassVar[str] = "decode_path"
    default: PathChoice = "auto"
    slack_cores: Annotated[float, Field(ge=0)] = 2.0
    slack_delay_s: Annotated[float, Field(ge=0)] = 0.0
    rate_hz: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 100.0

    def apply(self, rewrite: Rewrite, context: Context) -> Rewrite:
        """Choose the paths, and rewrite the connections that nengo-loihi does not build itself."""
        solver = ParameterSolver(rewrite, context.dt_s)
        scope = rewrite.scope
        links = [c for c in rewrite.network.all_connections if is_link(c, scope)]
        wanted = self._wanted(links, NetworkSettings(rewrite.network))
        found = {c: link(c, solver) for c in links}
        most = context.chip.limits.most("in_axons")
        errors = DirectErrors(found, scope, solver, _profiles(context), most)
        costs = self._costs(found, errors, wanted, context)
        relay_s = DECODE_TAU_S + context.dt_s + EPSILON_S

        def filters_of(free: Sequence[nengo.Connection]) -> Filters:
            return _target_filters(scope, wanted, free, relay_s)

        reasons, filters = self._settled(costs, wanted, errors, filters_of, relay_s)
        for c in links:
            context.note(rewrite.names[c], _note(costs[c], reasons[c]))
        paths = {c: chosen(costs[c], reasons[c]) for c in links}
        return rewire(rewrite, paths, found, filters, solver)

    def _costs(
        self,
        links: Mapping[nengo.Connection, Link],
        errors: DirectErrors,
        wanted: Mapping[nengo.Connection, str],
        context: Context,
    ) -> Costs:
        """Return the costs of all paths, as if all connections that may be direct were direct."""
        direct = {c for c in links if wanted[c] in ("auto", "direct")}
        limits, dt_s = context.chip.limits, context.dt_s
        lost = {c: errors.of(c, direct, time_constant_s(c)) for c in links}
        costs = {}
        for c, one in links.items():
            found = path_costs(one, lost[c], limits, dt_s, self.rate_hz)
            decoded_there = wanted[c] == "host" or not _is_of_events(c)
            costs[c] = [cost for cost in found if cost.path != "host" or decoded_there]
        return costs

    def _settled(
        self,
        costs: Costs,
        wanted: Mapping[nengo.Connection, str],
        errors: DirectErrors,
        filters_of: Callable[[Sequence[nengo.Connection]], Filters],
        relay_s: float,
    ) -> tuple[dict[nengo.Connection, dict[str, str]], Filters]:
        """Reject paths until none is rejected; return the reasons, and the filters of the targets.

        The direct connections into a target decide its filter and the scale of its weights, and so
        the error of each other. If some are rejected, the rest is judged again. At the end, the
        errors in ``costs`` are those beside the connections that are left. Direct connections whose
        axons a core has no room for are rejected last.
        """
        reasons = {c: self._rejected(costs[c], wanted[c]) for c in costs}
        set_direct = [c for c in costs if wanted[c] == "direct"]
        free, left = None, [c for c in costs if _is_free(wanted[c], reasons[c])]
        while left != free:
            free = left
            filters, direct = filters_of(free), {*free, *set_direct}
            for c in direct:
                costs[c] = _with_error(costs[c], errors.of(c, direct, filters[c.post_obj]))
            for c in free:
                shared = -EPSILON_S <= filters[c.post_obj] - time_constant_s(c) <= relay_s
                not_direct = "" if shared else OTHER_FILTER
                reasons[c] = self._rejected(costs[c], wanted[c], not_direct)
            left = [c for c in free if _is_free(wanted[c], reasons[c])]
            if left == free:
                for c in errors.crowded(free, direct, filters):
                    reasons[c] = self._rejected(costs[c], wanted[c], CROWDED)
                    left = [one for one in left if one is not c]
        return reasons, filters

    def _wanted(
        self, links: Sequence[nengo.Connection], settings: NetworkSettings
    ) -> dict[nengo.Connection, str]:
        """Return the path that each connection asks for; the host decodes no events of a file."""
        wanted = {c: settings.get(c, "decode_path") or self.default for c in links}
        return {
            c: "auto" if path == self.default == "host" and _is_of_events(c) else path
            for c, path in wanted.items()
        }

    def _rejected(self, costs: list[PathCost], wanted: str, not_direct: str = "") -> dict[str, str]:
        if wanted != "auto":
            return all_but(wanted, costs)
        return rejected(costs, Slack(self.slack_cores, self.slack_delay_s), not_direct)


def _is_of_events(connection: nengo.Connection) -> bool:
    return isinstance(connection.pre_obj, nengo.Node)


def _is_free(wanted: str, reasons: Mapping[str, str]) -> bool:
    """Return whether the choice is left to the pass, and direct wiring is not rejected."""
    return wanted == "auto" and "direct" not in reasons


def _with_error(costs: list[PathCost], error: float) -> list[PathCost]:
    """Return the costs of all paths, with a new error of direct wiring."""
    return [one._replace(error=error) if one.path == "direct" else one for one in costs]


def _profiles(context: Context) -> int:
    """Return the most thresholds that the passes after this one give to a block."""
    following = [one for one in context.following if isinstance(one, ScaleRows)]
    return max((one.most(context.chip) for one in following), default=1)


def _target_filters(
    scope: Scope,
    wanted: Mapping[nengo.Connection, str],
    free: Sequence[nengo.Connection],
    relay_s: float,
) -> Filters:
    """Return the time constant of each target's compartments, in seconds.

    Parameters
    ----------
    scope : Scope
        The network.
    wanted : mapping of nengo.Connection to str
        The path that each connection with a choice asks for.
    free : sequence of nengo.Connection
        The connections with a free choice that may be wired directly.
    relay_s : float
        The delay that a relay adds to inputs which keep their own filter, in seconds.
    """
    asked, offered, own = defaultdict(set), defaultdict(set), defaultdict(set)
    quiet = defaultdict(set)
    may_be_direct = set(free)
    for c in scope.network.all_connections:
        if not scope.on_chip(c.post_obj):
            continue
        path, post = wanted.get(c), base(c.post_obj)
        if path not in (*RELAYS, "auto"):
            asked[post].add(_filter_on_path_s(c, path, scope))
            continue
        own[post].add(time_constant_s(c))
        if c in may_be_direct:
            offered[post].add(time_constant_s(c))
        else:
            quiet[post].add(DECODE_TAU_S)  # which filters the noise of its relay
    return {
        post: _slowest(
            asked[post] | quiet[post],
            offered[post],
            min(asked[post] | own[post], default=0) + relay_s,
        )
        for post in scope.ensembles
    }


def _slowest(asked: set[float], offered: set[float], limit_s: float) -> float:
    """Return the longest time constant of those asked for, and those offered within a limit."""
    found = asked | {tau_s for tau_s in offered if tau_s <= limit_s}
    return max(found, default=DECODE_TAU_S)


def _filter_on_path_s(connection: nengo.Connection, path: str | None, scope: Scope) -> float:
    if path == "direct":
        return time_constant_s(connection)
    return asked_filter_s(connection, scope.on_chip(connection.pre_obj))


def _note(costs: list[PathCost], reasons: dict[str, str]) -> dict[str, object]:
    front = {one.path for one in pareto(costs)}
    return {
        "chosen": chosen(costs, reasons),
        "paths": [
            {**one._asdict(), "pareto": one.path in front, "not_chosen": reasons.get(one.path)}
            for one in costs
        ],
    }
