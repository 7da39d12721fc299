"""Rules SP420 and SP422: connections that learn on the chip at another rate, or not at all.

    rate on the chip = learning_rate radius / amplitude**2

of the ensemble before the connection. nengo-loihi converts decoders to the chip's units, but not
their change by PES; spikeport keeps its bits. A rate that is too small is rounded to 0.
"""

from collections.abc import Iterator

import nengo
import numpy as np

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.scope import Scope
from spikeport.compile.image.chip_image import ChipImage


def learning_rate_hints(scope: Scope) -> Iterator[Violation]:
    """Yield a hint on each connection that learns on the chip at another rate than in Nengo."""
    for connection in scope.network.all_connections:
        pre, rule = connection.pre_obj, connection.learning_rule_type
        # Rules of other types, and lists of rules, are refused on the chip.
        learns = isinstance(rule, nengo.PES) and isinstance(pre, nengo.Ensemble)
        if not (learns and scope.on_chip(pre)):
            continue
        times = pre.radius / getattr(pre.neuron_type, "amplitude", 1.0) ** 2
        if not np.isclose(times, 1):
            acts = rule.learning_rate * times
            used = f"{rule.learning_rate:g} acts as {acts:.4g}, {times:.4g} times as much"
            factor = f"{1 / times:.4g}"
            yield rules.get("SP420").broken(scope.names[connection], used, factor=factor)


def unlearnt_hints(image: ChipImage) -> Iterator[Violation]:
    """Yield a hint on each connection whose traces stay at 0, so that it learns nothing."""
    for group in np.flatnonzero(image.learns):
        if image.learning_of(group)["tracing_mag"] == 0:
            label = image.manifest.blocks[int(image.groups.block[group])].label
            yield rules.get("SP422").broken(label, "a spike adds 0 to its trace")
