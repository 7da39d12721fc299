"""Exact counts of spikes, synaptic operations, updates and messages, step by step."""

import numpy as np

from spikeport.compile.image.fanout import Fanout
from spikeport.hardware_models.activity import PER_STEP, Activity


class Counter:
    """A counter of events on the cores of a chip.

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
        np.add.at(self._delivered, delivered, 1)
        self._rows.append(
            np.stack(
                [
                    np.bincount(self._source_core[spiked], minlength=n),
                    self._fanout.synaptic_operations[delivered].sum(axis=0),
                    np.bincount(self._source_core[active], minlength=n),
                    np.bincount(self._source_core[~active], minlength=n),
                    self._fanout.messages[delivered].sum(axis=0),
                    np.zeros(n, int) if learning_updates is None else learning_updates,
                ]
            )
        )

    def activity(self, dt_s: float) -> Activity:
        """Return all counts so far."""
        n, compartments = len(self._cores), len(self._source_core)
        per_source = self._fanout.messages * self._delivered[:, np.newaxis]
        messages = np.zeros((n, n), dtype=np.int64)
        np.add.at(messages, self._source_core, per_source[:compartments])
        host = per_source[compartments:].sum(axis=0)
        return make_activity(self._cores, dt_s, self._rows, (messages, host), self.readout_spikes)


def make_activity(
    cores: tuple[str, ...],
    dt_s: float,
    rows: list[np.ndarray],
    messages: tuple[np.ndarray, np.ndarray],
    readout_spikes: int,
) -> Activity:
    """Return an `Activity` of counts.

    Parameters
    ----------
    cores, dt_s, readout_spikes
        As in `Activity`.
    rows : list of (6, n_cores) int array
        For each step, the counts in the order of `PER_STEP`.
    messages : tuple of (n_cores, n_cores) and (n_cores,) int array
        Messages of the whole run from core to core, and from the host.
    """
    table = np.array(rows, dtype=np.int64).reshape(len(rows), len(PER_STEP), len(cores))
    return Activity(
        cores=cores,
        dt_s=dt_s,
        messages=messages[0],
        messages_host=messages[1],
        readout_spikes=readout_spikes,
        **{name: table[:, i] for i, name in enumerate(PER_STEP)},
    )
