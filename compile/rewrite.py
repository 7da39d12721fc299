"""A network on its way through the passes, and what became of the objects it was made of."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import nengo

from spikeport.compile.names import Names


@dataclass(frozen=True)
class Rewrite:
    """A network and its relation to the one that the user wrote.

    ``stand_ins`` maps the user's probes to those that record the same here; ``built`` maps the
    user's ensembles and connections that are here no longer to what Nengo built of them. Objects
    that appear in neither are still themselves.
    """

    network: nengo.Network
    names: Names
    stand_ins: Mapping[nengo.Probe, nengo.Probe] = field(default_factory=dict)
    built: Mapping[Any, Any] = field(default_factory=dict)
