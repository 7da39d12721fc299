"""The narrow protocol of a running network, for any backend."""

from typing import Protocol

import nengo
import numpy as np
from nengo.base import NengoObject

from spikeport.compile.ground.rewrite import Built
from spikeport.compile.pipeline import Compilation
from spikeport.hardware_models.activity import Activity


class Execution(Protocol):
    """A network, built and at rest."""

    @property
    def compilation(self) -> Compilation | None:
        """The compiled network; None if the backend uses no chip."""

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the link to a board, for JSON; None without a link."""

    def step(self) -> None:
        """Advance by one time step."""

    def data(self, probe: nengo.Probe) -> np.ndarray:
        """Return the values that a probe recorded so far, (n_steps, size)."""

    def built(self, obj: NengoObject) -> Built:
        """Return the built parameters of an ensemble or connection: gains, encoders, weights.

        Raises
        ------
        KeyError
            If the object is not part of the network.
        """

    def clear_probes(self) -> None:
        """Forget the values that probes recorded so far."""

    def activity(self) -> Activity:
        """Return exact counts of all steps so far."""

    def close(self) -> None:
        """Free the execution's resources; it cannot step any more."""
