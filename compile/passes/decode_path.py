"""`DecodePath`: a path for each decoded connection between ensembles on the chip."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import nengo
from nengo.ensemble import Neurons
from pydantic import Field

from spikeport.compile.ground.names import base
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import Scope
from spikeport.compile.ground.settings import NetworkSettings
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.passes.base import Context, NetworkPass
from spikeport.compile.rewriting.decode_paths import (
    DECODE_TAU_S,
    EPSILON_S,
    PathCost,
    Slack,
    all_but,
    chosen,
    link,
    pareto,
    path_costs,
    rejected,
)
from spikeport.compile.rewriting.passthrough import PLAIN
from spikeport.compile.rewriting.rewire import rewire

PathChoice = Literal["auto", "direct", "onoff", "preset10", "host"]
LINEAR = (*PLAIN, nengo.Sparse)


@dataclass(frozen=True)
class DecodePath(NetworkPass):
    """Wire decoded connections neuron to neuron, over decode neurons, or over the host.

    ``network.config[connection].decode_path`` (see `spikeport.add_params`) decides where it is set,
    then ``default``. ``auto`` takes what loses least among all that need at most ``slack_cores``
    more than the fewest, where that is at most ``slack_delay_s`` slower than over decode neurons:
    an ensemble has one filter, the longest of all that goes into it, of 5 ms behind decode neurons
    and inputs. The way over the host takes a step more, and traffic with the chip in every step.

    Attributes
    ----------
    default : str
        The path where none is set.
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
        """Choose the paths, and rewrite all but those that nengo-loihi builds itself."""
        solver = ParameterSolver(rewrite, context.dt_s)
        scope = Scope(rewrite.network, rewrite.names)
        links = [c for c in rewrite.network.all_connections if _is_link(c, scope)]
        costs = {
            c: path_costs(link(c, solver), context.chip.limits, context.dt_s, self.rate_hz)
            for c in links
        }
        settings = NetworkSettings(rewrite.network)
        wanted = {c: settings.get(c, "decode_path") or "auto" for c in links}
        wanted = {c: self.default if path == "auto" else path for c, path in wanted.items()}
        reasons = {c: self._rejected(costs[c], wanted[c], slowed=False) for c in links}
        first = {c: chosen(costs[c], reasons[c]) for c in links}
        relay_s = DECODE_TAU_S + context.dt_s
        for c in _slowed(first, rewrite.network.all_connections, scope, relay_s):
            reasons[c] = self._rejected(costs[c], wanted[c], slowed=True)
        for c in links:
            context.note(rewrite.names[c], _note(costs[c], reasons[c]))
        return rewire(rewrite, {c: chosen(costs[c], reasons[c]) for c in links}, solver)

    def _rejected(self, costs: list[PathCost], wanted: str, slowed: bool) -> dict[str, str]:
        if wanted != "auto":
            return all_but(wanted, costs)
        return rejected(costs, Slack(self.slack_cores, self.slack_delay_s), slowed)


def _is_link(connection: nengo.Connection, scope: Scope) -> bool:
    """Return whether nengo-loihi would build plain decode neurons for a connection."""
    pre, post = connection.pre_obj, connection.post_obj
    return (
        scope.on_chip(pre)
        and scope.on_chip(post)
        and isinstance(post, nengo.Ensemble)
        and not (isinstance(pre, nengo.Ensemble) and connection.solver.weights)
        and connection.learning_rule_type is None
        and isinstance(connection.transform, LINEAR)
    )


def _slowed(
    paths: dict[nengo.Connection, str],
    connections: Sequence[nengo.Connection],
    scope: Scope,
    relay_s: float,
) -> list[nengo.Connection]:
    """Return the direct connections that their target would delay more than a relay.

    An ensemble has one filter, the longest of all its inputs.
    """
    filters: dict[nengo.Ensemble, float] = {}
    for c in connections:
        if scope.on_chip(c.post_obj):
            post = base(c.post_obj)
            own = _filter_s(c, paths.get(c), scope)
            filters[post] = max(own, filters.get(post, 0.0))
    most = {c: _filter_s(c, "direct", scope) + relay_s + EPSILON_S for c in paths}
    return [c for c, path in paths.items() if path == "direct" and filters[c.post_obj] > most[c]]


def _filter_s(connection: nengo.Connection, path: str | None, scope: Scope) -> float:
    spikes = scope.on_chip(connection.pre_obj) or isinstance(connection.pre_obj, Neurons)
    decoded = isinstance(connection.post_obj, nengo.Ensemble) and path != "direct"
    if decoded or not spikes:
        return DECODE_TAU_S
    return getattr(connection.synapse, "tau", 0.0)  # lint refuses other filters than low-pass


def _note(costs: list[PathCost], reasons: dict[str, str]) -> dict[str, object]:
    front = {one.path for one in pareto(costs)}
    return {
        "chosen": chosen(costs, reasons),
        "paths": [
            {**one._asdict(), "pareto": one.path in front, "not_chosen": reasons.get(one.path)}
            for one in costs
        ],
    }
