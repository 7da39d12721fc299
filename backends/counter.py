"""Exact counts of spikes, synaptic operations, updates and messages, step by step."""

import numpy as np

from spikeport.compile.fanout import Fanout
from spikeport.hardware_models.activity import Activity


class Counter:
    """Counts what happens on the cores of a chip.

    Parameters
    ----------
    cores : tuple of str
        A label for each core.
    source_core : (n_compartments,) int array
        The core of each compartment.
    fanout : Fanout
        Costs of a spike, for compartments first and inputs after them.
    """

    def __init__(self, cores: tuple[str, ...], source_core: np.ndarray, fanout: Fanout) -> None:
        self._cores = cores
        self._source_core = source_core
        self._fanout = fanout
        self._delivered = np.zeros(len(fanout.messages), dtype=np.int64)
        self._rows: list[np.ndarray] = []
        self.readout_spikes = 0

    def step(
        self,
        delivered: np.ndarray,
        spiked: np.ndarray,
        active: np.ndarray,
        learning_updates: np.ndarray | None = None,
    ) -> None:
        """Count one step.

        Parameters
        ----------
        delivered : (n,) int array
            Sources whose spikes arrive at synapses in this step.
        spiked, active : (n_compartments,) bool array
            Compartments that spike, and whose state is not at rest, in this step.
        learning_updates : (n_cores,) int array, optional
            Weights changed by learning in this step.
        """
        n = len(self._cores)
        self._delivered[delivered] += 1
        self._rows.append(
            np.stack(
                [
                    np.bincount(self._source_core[spiked], minlength=n),
                    np.bincount(self._source_core[active], minlength=n),
                    np.bincount(self._source_core[~active], minlength=n),
                    self._fanout.synaptic_operations[delivered].sum(axis=0),
                    self._fanout.messages[delivered].sum(axis=0),
                    np.zeros(n, int) if learning_updates is None else learning_updates,
                ]
            )
        )

    def activity(self, dt_s: float) -> Activity:
        """All counts so far."""
        n = len(self._cores)
        table = (
            np.array(self._rows, dtype=np.int64).reshape(len(self._rows), 6, n).transpose(1, 0, 2)
        )
        spikes, active, inactive, operations, messages_in, learning = table
        compartments = len(self._source_core)
        per_source = self._fanout.messages * self._delivered[:, np.newaxis]
        messages = np.zeros((n, n), dtype=np.int64)
        np.add.at(messages, self._source_core, per_source[:compartments])
        return Activity(
            cores=self._cores,
            dt_s=dt_s,
            spikes=spikes,
            updates_active=active,
            updates_inactive=inactive,
            synaptic_operations=operations,
            messages_in=messages_in,
            learning_updates=learning,
            messages=messages,
            messages_host=per_source[compartments:].sum(axis=0),
            readout_spikes=self.readout_spikes,
        )
