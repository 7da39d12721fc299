"""Rule SP420: connections that learn on the chip at another rate than in float Nengo.

    rate on the chip = learning_rate radius / amplitude**2

of the ensemble before the connection. nengo-loihi converts decoders to the chip's units, but not
their change by PES; spikeport keeps its bits.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import nengo
import numpy as np

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.scope import Scope


def learning_rate_hints(network: nengo.Network, names: Names) -> Iterator[Violation]:
    """Yield a hint on each connection that learns on the chip at another rate than in Nengo."""
    scope = Scope(network, names)
    for connection in network.all_connections:
        pre = connection.pre_obj
        if not (isinstance(pre, nengo.Ensemble) and scope.on_chip(pre)):
            continue
        times = pre.radius / getattr(pre.neuron_type, "amplitude", 1.0) ** 2
        for one in filter(lambda one: isinstance(one, nengo.PES), _learning(connection)):
            if not np.isclose(times, 1):
                rate = one.learning_rate
                used = f"{rate:g} acts as {rate * times:.4g}, {times:.4g} times as much"
                name = names[connection]
                yield rules.get("SP420").broken(name, used, factor=f"{1 / times:.4g}")


def _learning(connection: nengo.Connection) -> Sequence[nengo.learning_rules.LearningRuleType]:
    """Return the learning rules of a connection, which has one, several or none."""
    found = connection.learning_rule_type
    if isinstance(found, Mapping):
        return [*found.values()]
    if isinstance(found, Iterable):
        return [*found]
    return [] if found is None else [found]
