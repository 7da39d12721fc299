"""The counts of a run, step by step, in memory that does not grow with the number of steps."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport.files import write_arrays
from spikeport.hardware_models.activity import PER_RUN, PER_STEP, Activity, Folded
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.step_time import fold

KEPT_STEPS = 10_000
"""Steps that are kept one by one (12 MB on 24 cores) before they are folded into sums."""
PIECE = 250
"""Steps that are folded at once. To fold all kept ones takes 0.2 s, and a robot in real time is
damped after 0.04 s: they are folded one piece after the other, while as many new ones come."""


@dataclass(frozen=True)
class LogOptions:
    """Options of a log of steps.

    Attributes
    ----------
    chip : ChipModel, optional
        The chip for which energy and time are computed; without one, a run of more than
        `KEPT_STEPS` steps has neither.
    folder : Path, optional
        A folder for the counts of all steps.
    """

    chip: ChipModel | None = None
    folder: Path | None = None


SUMS_ONLY = LogOptions()
"""The options of a log whose folded steps have no energy and time."""


def counts_files(folder: Path) -> list[Path]:
    """Return the files in which a log left counts, in the order of their steps."""
    return sorted(folder.glob("counts-*.npz"))


MESSAGES = "messages.npz"
"""The file of a log's messages, which are counted over the whole run."""


class MessageCounts(NamedTuple):
    """Messages so far from core to core, (n_cores, n_cores), and from the host, (n_cores,)."""

    between: np.ndarray
    from_host: np.ndarray


class Totals(NamedTuple):
    """The messages of all steps, and the spikes of compartments that must not spike."""

    messages: MessageCounts
    readout_spikes: int


class StepLog:
    """A log of the counts of every step.

    With a folder, every `KEPT_STEPS` steps are written to ``counts-FIRST.npz`` before they are
    folded, and the rest when the log is closed: arrays of `PER_STEP`, each (n_steps, n_cores), and
    ``host_spikes``, (n_steps,). Closing writes `MESSAGES` too: ``between_cores`` and ``from_host``
    as in `MessageCounts`, ``cores`` and ``dt_s``.

    Parameters
    ----------
    cores, dt_s
        As in `Activity`.
    totals : callable
        Returns the totals so far.
    options : LogOptions
        Chip and folder.

    Attributes
    ----------
    totals : callable
        See the parameter.
    last : (6, n_cores) array
        The counts of the last step; zeros before the first.
    """

    def __init__(
        self,
        cores: tuple[str, ...],
        dt_s: float,
        totals: Callable[[], Totals],
        options: LogOptions = SUMS_ONLY,
    ) -> None:
        if options.folder is not None:  # files of this simulation, before it was reset
            for old in (*counts_files(options.folder), options.folder / MESSAGES):
                old.unlink(missing_ok=True)
        self._cores, self._dt_s, self.totals = cores, dt_s, totals
        self._options = options
        self._rows: list[np.ndarray] = []
        self._from_host: list[int] = []
        self.last = np.zeros((len(PER_STEP), len(cores)), dtype=np.int64)
        self._folded: Folded | None = None
        self._folding: Iterator[Folded] = iter(())

    def append(self, counts: np.ndarray, from_host: int) -> None:
        """Add a step.

        Parameters
        ----------
        counts : (6, n_cores) array
            The counts, in the order of `PER_STEP`.
        from_host : int
            The spikes that the host sent.
        """
        self._rows.append(counts)
        self._from_host.append(from_host)
        self.last = counts
        if len(self._rows) % PIECE == 0:
            self._folded = next(self._folding, self._folded)
        if len(self._rows) == KEPT_STEPS:
            self._let_go()

    def _let_go(self) -> None:
        """Begin to fold the steps that are kept."""
        self._fold_rest()
        self._write()
        self._folding = self._folded_up_to(self._rows, self._from_host, self.totals())
        self._rows, self._from_host = [], []

    def _folded_up_to(
        self, rows: Sequence[np.ndarray], from_host: Sequence[int], totals: Totals
    ) -> Iterator[Folded]:
        """Yield the sums up to each piece of some steps; the totals are those at their end."""
        folded, n = self._folded, len(rows)
        before = (0, 0) if folded is None else [folded.sums[name] for name in PER_RUN]
        for begin in range(0, n, PIECE):
            end = min(begin + PIECE, n)
            # Messages are only known for all steps together.
            spread = (b + (a - b) * end / n for a, b in zip(totals.messages, before, strict=True))
            so_far = totals if end == n else totals._replace(messages=MessageCounts(*spread))
            piece = self._activity(rows[begin:end], from_host[begin:end], so_far, folded)
            folded = fold(piece, self._options.chip)
            yield folded

    def _fold_rest(self) -> None:
        for folded in self._folding:
            self._folded = folded

    def _write(self) -> None:
        """Write the steps that are kept, if there is a folder for them."""
        if self._options.folder is not None and self._rows:
            first = 0 if self._folded is None else self._folded.n_steps
            # Padded, as files are read in the order of their names.
            path = self._options.folder / f"counts-{first:012d}.npz"
            write_arrays(path, self._table(self._rows, self._from_host))

    def _table(self, rows: Sequence[np.ndarray], from_host: Sequence[int]) -> dict[str, np.ndarray]:
        """Return the counts of some steps by name, (n, n_cores), and the host's spikes, (n,)."""
        shape = len(rows), len(PER_STEP), len(self._cores)
        table = np.array(rows, dtype=np.int64).reshape(shape)
        sent = np.array(from_host, dtype=np.int64)
        return {**{name: table[:, i] for i, name in enumerate(PER_STEP)}, "host_spikes": sent}

    def _activity(
        self,
        rows: Sequence[np.ndarray],
        from_host: Sequence[int],
        totals: Totals,
        folded: Folded | None,
    ) -> Activity:
        """Return the counts of some steps after those that are folded, and the totals of both."""
        return Activity(
            cores=self._cores,
            dt_s=self._dt_s,
            messages=totals.messages.between,
            messages_host=totals.messages.from_host,
            readout_spikes=totals.readout_spikes,
            folded=folded,
            cut_off={},  # known to the host alone
            **self._table(rows, from_host),
        )

    def activity(self) -> Activity:
        """Return the counts so far."""
        self._fold_rest()
        return self._activity(self._rows, self._from_host, self.totals(), self._folded)

    def close(self) -> None:
        """Write the steps that are not yet written, and the messages; the counts stay readable."""
        self._fold_rest()
        self._write()
        folder = self._options.folder
        if folder is not None and counts_files(folder):
            between, from_host = self.totals().messages
            cores, dt_s = np.array(self._cores), np.array(self._dt_s)
            arrays = {"between_cores": between, "from_host": from_host}
            write_arrays(folder / MESSAGES, {**arrays, "cores": cores, "dt_s": dt_s})
