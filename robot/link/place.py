"""Places where a robot can be reached: a network interface, and a DDS domain."""

import re
import socket
from typing import NamedTuple

from spikeport.errors import UsageError

LOOPBACK = "lo"
SIMULATION, REAL = 1, 0
"""The domains of simulated robots and of real ones."""
LARGEST_DOMAIN = 230


class Place(NamedTuple):
    """A network interface and a DDS domain."""

    interface: str = LOOPBACK
    domain: int = SIMULATION

    @property
    def may_be_real(self) -> bool:
        """True if a real robot may listen there."""
        return self.domain == REAL or self.interface != LOOPBACK

    def check(self, may_move_a_robot: bool) -> None:
        """Raise UsageError for an unknown place, or a place of real robots that is not allowed."""
        names = [name for _, name in socket.if_nameindex()]
        # The name goes into Cyclone's XML: a quote in it would end the attribute.
        if self.interface not in names or not re.fullmatch(r"[\w.:@-]+", self.interface):
            raise UsageError(f"no interface '{self.interface}'; choose from: {', '.join(names)}")
        if not 0 <= self.domain <= LARGEST_DOMAIN:
            raise UsageError(f"domain {self.domain}: must be from 0 to {LARGEST_DOMAIN}")
        if self.may_be_real and not may_move_a_robot:
            raise UsageError(
                f"interface '{self.interface}', domain {self.domain}: a real robot may listen "
                "there, and would move; if that is meant, give --may-move-a-real-robot, else use "
                f"{LOOPBACK}, domain {SIMULATION}"
            )
