"""Exact counts of spikes, synaptic operations, updates and messages, step by step."""

import numpy as np

from spikeport.backends.step_log import SUMS_ONLY, LogOptions, MessageCounts, StepLog, Totals
from spikeport.compile.image.fanout import Fanout
from spikeport.hardware_models.activity import Activity


class Counter:
    """A counter of events on the cores of a chip.

    Parameters
    ----------
    cores : tuple of str
        A label for each core.
    dt_s : float
        Length of a step, in s.
    source_core : (n_compartments,) int array
        The core of each compartment.
    fanout : Fanout
        Costs of a spike of each source: compartments first, then inputs.
    options : LogOptions
        See `StepLog`.
    """

    def __init__(
        self,
        cores: tuple[str, ...],
        dt_s: float,
        source_core: np.ndarray,
        fanout: Fanout,
        options: LogOptions = SUMS_ONLY,
    ) -> None:
        self._n_cores = len(cores)
        self._source_core = source_core
        self._fanout = fanout
        self._delivered = np.zeros(len(fanout.messages), dtype=np.int64)
        self.log = StepLog(cores, dt_s, self._totals, options)
        self.readout_spikes = 0

    def step(
        self,
        delivered: np.ndarray,
        spiked: np.ndarray,
        active: np.ndarray,
        learning_updates: np.ndarray | None = None,
        from_host: int = 0,
    ) -> None:
        """Count one step.

        Parameters
        ----------
        delivered : (n,) int array
            Sources whose spikes arrive at synapses in this step; one with two is listed twice.
        spiked : (n_compartments,) bool array
            A mask of the compartments that spike in this step.
        active : (n_compartments,) bool array
            A mask of the compartments that are not at rest.
        learning_updates : (n_cores,) int array, optional
            Weights changed by learning in this step.
        from_host : int
            Spikes that the host sends in this step.
        """
        n = self._n_cores
        np.add.at(self._delivered, delivered, 1)
        self.log.append(
            np.stack(
                [
                    np.bincount(self._source_core[spiked], minlength=n),
                    self._fanout.synaptic_operations[delivered].sum(axis=0),
                    np.bincount(self._source_core[active], minlength=n),
                    np.bincount(self._source_core[~active], minlength=n),
                    self._fanout.messages[delivered].sum(axis=0),
                    np.zeros(n, int) if learning_updates is None else learning_updates,
                ]
            ),
            from_host,
        )

    def step_of_spikes(self, delivered: np.ndarray, spikes: np.ndarray) -> None:
        """Count one step without inputs, in which all are active and may spike several times.

        Parameters
        ----------
        delivered, spikes : (n_compartments,) int array
            For each compartment, how many of its spikes arrive at synapses in this step, and how
            often it spikes in this step.
        """
        counts = np.zeros((6, self._n_cores), dtype=np.int64)  # rows as in `step`
        if len(spikes):  # exact controllers have no neurons, and each of these calls takes time
            self._delivered += delivered
            sources = np.flatnonzero(delivered)
            times = delivered[sources]
            np.add.at(counts[0], self._source_core, spikes)
            counts[1] = times @ self._fanout.synaptic_operations[sources]
            counts[2] = np.bincount(self._source_core, minlength=self._n_cores)
            counts[4] = times @ self._fanout.messages[sources]
        self.log.append(counts, 0)

    def activity(self) -> Activity:
        """Return all counts so far."""
        return self.log.activity()

    def _totals(self) -> Totals:
        n, compartments = self._n_cores, len(self._source_core)
        per_source = self._fanout.messages * self._delivered[:, np.newaxis]
        between = np.zeros((n, n), dtype=np.int64)
        np.add.at(between, self._source_core, per_source[:compartments])
        messages = MessageCounts(between, per_source[compartments:].sum(axis=0))
        return Totals(messages, self.readout_spikes)

    def close(self) -> None:
        """Write the counts that the log still holds."""
        self.log.close()
