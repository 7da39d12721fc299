"""Networks that break a rule, and the same networks with its cures."""

from collections.abc import Callable
from typing import NamedTuple

import nengo
import nengo_loihi

from spikeport.compile.check.lint import lint
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.pipeline import compile_network
from spikeport.constants import DT_S
from tests.helpers.small_networks import scope_of

Found = set[str]
"""The ids of the rules that are broken."""
Check = Callable[[], Found]


class Case(NamedTuple):
    """A cure for a rule: a check that finds the rule broken, and a check for each way to cure it.

    ``cure`` is the beginning of the cure's text.
    """

    rule: str
    cure: str
    broken: Check
    cured: tuple[Check, ...]


def network_of(make: Callable[[], object]) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        make()
    return network


def on_host(ensemble: nengo.Ensemble) -> None:
    nengo.Network.context[0].config[ensemble].on_chip = False


def linted(make: Callable[[], object]) -> Check:
    """Return a check of the rules of networks; a network that breaks none is compiled."""

    def check() -> Found:
        network = network_of(make)
        if broken := lint(scope_of(network)):
            return {one.id for one in broken}
        return compiled(make)()

    return check


def compiled(make: Callable[[], object], chip: str = "loihi", passes: str = "") -> Check:
    """Return a check by a compile, by default without passes: every block on a core of its own."""

    def check() -> Found:
        try:
            compile_network(network_of(make), chip, pipeline=passes)
        except DoesNotFitError as error:
            return {one.id for one in error.violations}
        return set()

    return check


def hinted(make: Callable[[], object], passes: str = "", dt_s: float = DT_S) -> Check:
    """Return a check of the hints of a compile."""
    return lambda: {
        one.id for one in compile_network(network_of(make), dt=dt_s, pipeline=passes).report.hints
    }
