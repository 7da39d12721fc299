"""Counts of the events on the cores in a run, on which energy and time depend.

Counts of a run are exact integers. Counts that are expected of a future run are not.

Steps of a long run are not kept one by one: they are folded into the sums that energy and time
need, see `spikeport.hardware_models.step_time.fold`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from spikeport.counted import counted
from spikeport.errors import UsageError
from spikeport.table import Table

if TYPE_CHECKING:
    from spikeport.hardware_models.chip import ChipModel
    from spikeport.hardware_models.step_time import TimeSums

# A step takes as long as its slowest core, so these counts are kept step by step. Messages cost
# energy, for which sums are enough.
PER_STEP = (
    "spikes",
    "synaptic_operations",
    "updates_active",
    "updates_inactive",
    "messages_in",
    "learning_updates",
)
PER_RUN = ("messages", "messages_host")


class HostSpikes(NamedTuple):
    """The spikes that the host sent: in sum, in the mean of all steps, and the most in a step."""

    total: int | float
    mean: float
    most: int | float


@dataclass(frozen=True, eq=False)
class Folded:
    """The first steps of a run, which are no longer kept one by one.

    Attributes
    ----------
    n_steps : int
        Number of the steps.
    sums : mapping of str to (n_cores,) array
        The counts of `PER_STEP` and ``messages_host``, and ``messages`` as (n_cores, n_cores).
    chip : ChipModel or None
        The chip that the times were computed for, if any.
    times : mapping of str to TimeSums
        The times of the steps, by calibration of the chip.
    host_spikes, most_host_spikes : int
        Spikes that the host sent in all of the steps, and the most in one.
    """

    n_steps: int
    sums: Mapping[str, np.ndarray]
    chip: "ChipModel | None"
    times: Mapping[str, "TimeSums"]
    host_spikes: int | float
    most_host_spikes: int | float


@dataclass(frozen=True, eq=False)
class Activity:
    """Counts of a run, or counts expected of one. Consecutive runs add up: see `concatenate`.

    The arrays by step hold the n_kept steps that are kept: all, or the last ones of a long run.

    A message is one spike on its way to one destination core: a spike that reaches synapses on
    three cores is three messages.

    Parameters
    ----------
    cores : tuple of str
        A label for each core; core k of the chip is the k-th.
    dt_s : float
        Length of a step, in s.
    spikes : (n_kept, n_cores) array
        Spikes of the core's compartments.
    synaptic_operations : (n_kept, n_cores) array
        Weights added to compartments of the core.
    updates_active, updates_inactive : (n_kept, n_cores) array
        Updated compartments with a bias, or an input or a state other than zero, and the others.
    messages_in : (n_kept, n_cores) array
        Messages that arrived at the core, from other cores, itself and the host.
    learning_updates : (n_kept, n_cores) array
        Weights on the core that learning updated.
    messages : (n_cores, n_cores) array
        Messages of the whole run from source core (row) to destination core (column).
    messages_host : (n_cores,) array
        Messages of the whole run from the host to each core.
    host_spikes : (n_kept,) array
        Spikes that the host sent, each once, however many cores it reaches.
    readout_spikes : int
        Spikes of compartments that are read out and must not spike: 0, or the run is wrong.
    folded : Folded, optional
        The steps before those that are kept.
    cut_off : mapping of str to int
        For each input of values, by name, the steps in which a value was cut off: its source had to
        spike more than once. The source with the most such steps counts; of consecutive runs, that
        of each run.

    Raises
    ------
    ValueError
        An array has another shape, or does not hold numbers.
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
    host_spikes: np.ndarray
    readout_spikes: int = 0
    folded: Folded | None = None
    cut_off: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n_cores = len(self.cores)
        for name in PER_STEP:
            self._check(name, (len(self.spikes), n_cores), "(n_kept, n_cores)")
        self._check("messages", (n_cores, n_cores), "(n_cores, n_cores)")
        self._check("messages_host", (n_cores,), "(n_cores,)")
        self._check("host_spikes", (len(self.spikes),), "(n_kept,)")

    def _check(self, name: str, shape: tuple[int, ...], meaning: str) -> None:
        array = getattr(self, name)
        if array.shape != shape:
            raise ValueError(f"{name} has shape {array.shape}, not {shape} {meaning}")
        if array.dtype.kind not in "iuf":
            raise ValueError(f"{name} is of {array.dtype}, but counts are numbers")

    def __repr__(self) -> str:
        """Return steps, cores and spikes, on a line."""
        return f"<Activity: {self._extent()}, {self.over_steps('spikes').sum():,.0f} spikes>"

    def __str__(self) -> str:
        """Return the sums of all counts, as a table."""
        return str(self._table())

    def _repr_html_(self) -> str:
        """Return the sums of all counts as a notebook shows them."""
        return self._table().html()

    def _extent(self) -> str:
        cores = counted(len(self.cores), "core")
        return f"{counted(self.n_steps, 'step')} of {1000 * self.dt_s:g} ms on {cores}"

    def _table(self) -> Table:
        """Return the total of each count, its mean of a step, and the core with the most of it."""
        rows = []
        for name, counts in self.per_core().items():
            most = int(counts.argmax()) if counts.size else 0
            share = (f"{counts[most]:,.0f}", str(most)) if counts.any() else ("", "")
            by_step = counts.sum() / self.n_steps if self.n_steps else 0.0
            rows.append((name.replace("_", " "), f"{counts.sum():,.0f}", f"{by_step:,.1f}", *share))
        sent = self.from_host
        rows.append(("host spikes", f"{sent.total:,.0f}", f"{sent.mean:,.1f}", "", ""))
        header = ("count", "total", "per step", "most on a core", "core")
        return Table(self._extent(), header, tuple(rows))

    @property
    def n_steps(self) -> int:
        """Number of steps of the run."""
        return len(self.spikes) + (0 if self.folded is None else self.folded.n_steps)

    @property
    def saturated_inputs(self) -> dict[str, float]:
        """The share of steps in which values of an input were cut off, by the input's name."""
        return {name: steps / self.n_steps for name, steps in self.cut_off.items() if steps}

    @property
    def kept(self) -> "Activity":
        """The steps that are kept one by one, as a run of their own."""
        if self.folded is None:
            return self
        # Counts by step are already of the kept steps; messages are of the whole run.
        before = self.folded.sums
        return replace(
            self,
            messages=self.messages - before["messages"],
            messages_host=self.messages_host - before["messages_host"],
            folded=None,
        )

    @property
    def from_host(self) -> HostSpikes:
        """The spikes that the host sent in all steps."""
        total = self.host_spikes.sum().item()
        most = self.host_spikes.max(initial=0).item()
        if self.folded is not None:
            total += self.folded.host_spikes
            most = max(most, self.folded.most_host_spikes)
        return HostSpikes(total, total / self.n_steps if self.n_steps else 0.0, most)

    def over_steps(self, name: str) -> np.ndarray:
        """Return one of the counts of `PER_STEP` summed over all steps, (n_cores,)."""
        total: np.ndarray = getattr(self, name).sum(axis=0)
        return total if self.folded is None else total + self.folded.sums[name]

    def totals(self) -> dict[str, int | float]:
        """Return every count, summed over steps and cores."""
        # As Python's numbers: `json` cannot write NumPy's.
        sums = {name: self.over_steps(name).sum().item() for name in PER_STEP}
        sums |= {name: getattr(self, name).sum().item() for name in PER_RUN}
        sent = {"host_spikes": self.from_host.total}
        return {**sums, **sent, "readout_spikes": self.readout_spikes}

    def per_core(self) -> dict[str, np.ndarray]:
        """Return every count summed over steps, (n_cores,); ``messages`` by the core that sends."""
        sums = {name: self.over_steps(name) for name in PER_STEP}
        return {
            **sums,
            "messages": self.messages.sum(axis=1),
            "messages_host": self.messages_host.copy(),
        }

    @classmethod
    def concatenate(cls, parts: Sequence["Activity"]) -> "Activity":
        """Return the activity of consecutive runs on the same cores.

        Raises
        ------
        UsageError
            There are no parts, their cores or steps differ, or steps of a later one are folded.
        """
        if not parts:
            raise UsageError("no activities to concatenate; pass at least one")
        if len({(part.cores, part.dt_s) for part in parts}) != 1:
            raise UsageError("only activities of the same cores and dt_s make one run")
        if any(part.folded is not None for part in parts[1:]):
            raise UsageError(
                "an activity that keeps only sums of its first steps must be the first part; run "
                "it with `Simulator(counts=FOLDER)`, and read the counts of its steps there"
            )
        steps = {name: np.concatenate([getattr(p, name) for p in parts]) for name in PER_STEP}
        sums = {name: np.sum([getattr(p, name) for p in parts], axis=0) for name in PER_RUN}
        names = dict.fromkeys(name for part in parts for name in part.cut_off)
        return cls(
            cores=parts[0].cores,
            dt_s=parts[0].dt_s,
            host_spikes=np.concatenate([part.host_spikes for part in parts]),
            readout_spikes=sum(part.readout_spikes for part in parts),
            folded=parts[0].folded,
            cut_off={name: sum(part.cut_off.get(name, 0) for part in parts) for name in names},
            **steps,
            **sums,
        )
