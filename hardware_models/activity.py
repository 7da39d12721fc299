"""Counts of what happened on the cores in a run: all that energy and time depend on.

Counts of a run are exact, and integers. Those expected of a run before there is one are not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spikeport.errors import UsageError

PER_STEP = (
    "spikes",
    "synaptic_operations",
    "updates_active",
    "updates_inactive",
    "messages_in",
    "learning_updates",
)
PER_RUN = ("messages", "messages_host")


@dataclass(frozen=True, eq=False)
class Activity:
    """Counts of a run, or expected of one. Runs one after the other add up: see `concatenate`.

    A message is one spike on its way to one destination core: a spike that reaches synapses on
    three cores is three messages.

    Parameters
    ----------
    cores : tuple of str
        A label for each core; core k of the chip is the k-th.
    dt_s : float
        Length of a step, in s.
    spikes : (n_steps, n_cores) array
        Spikes of the core's compartments.
    synaptic_operations : (n_steps, n_cores) array
        Weights added to compartments of the core.
    updates_active, updates_inactive : (n_steps, n_cores) array
        Compartments updated whose state was not, or was, at rest.
    messages_in : (n_steps, n_cores) array
        Messages that arrived at the core, from other cores, itself and the host.
    learning_updates : (n_steps, n_cores) array
        Weights on the core that learning updated.
    messages : (n_cores, n_cores) array
        Messages of the whole run from source core (row) to destination core (column).
    messages_host : (n_cores,) array
        Messages of the whole run from the host to each core.
    readout_spikes : int
        Spikes of compartments that are read out and must not spike: 0, or the run is wrong.

    Raises
    ------
    ValueError
        An array has another shape, or holds no numbers.
    """

    cores: tuple[str, ...]
    dt_s: float
    spikes: np.ndarray
    synaptic_operations: np.ndarray
    updates_active: np.ndarray
    updates_inactive: np.ndarray
    messages_in: np.ndarray
    learning_updates: np.ndarray
    messages: np.ndarray
    messages_host: np.ndarray
    readout_spikes: int = 0

    def __post_init__(self) -> None:
        n_cores = len(self.cores)
        for name in PER_STEP:
            self._check(name, (len(self.spikes), n_cores), "(n_steps, n_cores)")
        self._check("messages", (n_cores, n_cores), "(n_cores, n_cores)")
        self._check("messages_host", (n_cores,), "(n_cores,)")

    def _check(self, name: str, shape: tuple[int, ...], meaning: str) -> None:
        array = getattr(self, name)
        if array.shape != shape:
            raise ValueError(f"{name} has shape {array.shape}, not {shape} {meaning}")
        if array.dtype.kind not in "iuf":
            raise ValueError(f"{name} is of {array.dtype}, but counts are numbers")

    @property
    def n_steps(self) -> int:
        """Number of steps of the run."""
        return len(self.spikes)

    def totals(self) -> dict[str, int | float]:
        """Every count, summed over steps and cores."""
        sums = {name: getattr(self, name).sum().item() for name in PER_STEP + PER_RUN}
        return {**sums, "readout_spikes": self.readout_spikes}

    def per_core(self) -> dict[str, np.ndarray]:
        """Every count summed over steps, each (n_cores,); ``messages`` by the core that sends."""
        sums = {name: getattr(self, name).sum(axis=0) for name in PER_STEP}
        return {
            **sums,
            "messages": self.messages.sum(axis=1),
            "messages_host": self.messages_host.copy(),
        }

    @classmethod
    def concatenate(cls, parts: Sequence["Activity"]) -> "Activity":
        """The activity of runs one after the other, of the same cores.

        Raises
        ------
        UsageError
            There are no parts, or their cores or steps differ.
        """
        if len({(part.cores, part.dt_s) for part in parts}) != 1:
            raise UsageError("only activities of the same cores and dt_s make one run")
        steps = {name: np.concatenate([getattr(p, name) for p in parts]) for name in PER_STEP}
        sums = {name: np.sum([getattr(p, name) for p in parts], axis=0) for name in PER_RUN}
        return cls(
            cores=parts[0].cores,
            dt_s=parts[0].dt_s,
            readout_spikes=sum(part.readout_spikes for part in parts),
            **steps,
            **sums,
        )
