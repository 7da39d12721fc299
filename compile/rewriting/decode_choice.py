"""Which way to wire a decoded connection, and why not the others."""

from collections.abc import Sequence
from dataclasses import dataclass

from spikeport.compile.rewriting.decode_cost import PathCost
from spikeport.compile.rewriting.relay import RELAYS

EPSILON_S = 1e-9
SLOWED = "a slower filter of its target would delay it more than decode neurons do"


@dataclass(frozen=True)
class Slack:
    """What a lower error may cost: cores beyond the fewest, and delay beyond decode neurons'."""

    cores: float
    delay_s: float


def rejected(costs: Sequence[PathCost], slack: Slack, slowed: bool) -> dict[str, str]:
    """Every path but the best, and why it is not.

    The best is what loses least among those that are not too slow and do not take too much.

    Parameters
    ----------
    costs : sequence of PathCost
        Of all paths.
    slack : Slack
        What a lower error may cost.
    slowed : bool
        Whether other connections would delay this one, wired directly.
    """
    reasons = {"direct": SLOWED} if slowed else {}
    relay_s = min(one.delay_s for one in costs if one.path in RELAYS)
    for one in costs:
        if (more_s := one.delay_s - relay_s) > slack.delay_s + EPSILON_S:
            reasons[one.path] = f"{1000 * more_s:g} ms slower than decode neurons"
    fewest = min(one.cores for one in costs if one.path not in reasons)
    for one in costs:
        if one.cores > fewest + slack.cores:
            reasons.setdefault(one.path, f"{one.cores - fewest:.2g} more cores than the fewest")
    left = [one for one in costs if one.path not in reasons]
    best = min(left, key=lambda one: one.error)
    lost = f"loses more than {best.path}"
    return reasons | {one.path: lost for one in left if one is not best}


def all_but(path: str, costs: Sequence[PathCost]) -> dict[str, str]:
    """Every path but one that is set."""
    return {one.path: f"{path} is set" for one in costs if one.path != path}


def chosen(costs: Sequence[PathCost], reasons: dict[str, str]) -> str:
    """The path that is not rejected."""
    return next(one.path for one in costs if one.path not in reasons)
