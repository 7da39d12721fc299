"""The narrow protocol of a network in progress, whatever it runs on."""

from typing import Any, Protocol

import nengo
import numpy as np

from spikeport.compile.pipeline import Compilation
from spikeport.hardware_models.activity import Activity


class Execution(Protocol):
    """A network, built and at rest."""

    @property
    def compilation(self) -> Compilation | None:
        """The compiled network; None where no chip is involved."""

    def step(self) -> None:
        """Advance by one time step."""

    def data(self, probe: nengo.Probe) -> np.ndarray:
        """(n_steps, size) what a probe recorded so far."""

    def built(self, obj: Any) -> Any:
        """What Nengo built of an ensemble or connection: gains, encoders, weights and so on.

        Raises
        ------
        KeyError
            If the object is not part of the network.
        """

    def clear_probes(self) -> None:
        """Forget what the probes recorded so far."""

    def activity(self) -> Activity:
        """Exact counts of all steps so far."""

    def close(self) -> None:
        """Free what the execution holds; it cannot step any more."""
