"""`ReplayChip`: a recorded session of a board, for a host that sends the same spikes again."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from spikeport.backends.board.messages import BodyError, Codec
from spikeport.backends.board.record import Record, RecordedStep
from spikeport.backends.chip import CLOSED
from spikeport.backends.host_checks import HostChecks
from spikeport.backends.recount import recounted
from spikeport.backends.step_log import KEPT_STEPS, SUMS_ONLY, LogOptions, StepLog, Totals
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from spikeport.hardware_models.activity import Activity


class ReplayChip:
    """A record in place of a board. Implements `spikeport.backends.chip.Chip`.

    If a session was interrupted, or only its beginning is played back, `spikeport.backends.recount`
    computes the counts.

    Parameters
    ----------
    image : ChipImage
        The image that was recorded.
    seed : int
        The seed of the run, which must be the record's.
    path : Path
        The record, see `spikeport.backends.board.record`.
    log : LogOptions
        See `spikeport.backends.step_log.StepLog`.

    Raises
    ------
    UsageError
        If the file is missing or is not a record.
    BackendError
        If it is a record of another image or seed.
    """

    def __init__(
        self, image: ChipImage, seed: int, path: Path, log: LogOptions = SUMS_ONLY
    ) -> None:
        self._image, self._path, self._codec = image, path, Codec(image)
        self._checks, self._closed = HostChecks(image), False
        self._record = Record(path)
        try:
            self._check_session(image, seed)
        except BackendError:
            self._record.close()
            raise
        self.link: dict[str, object] | None = {
            "replays": str(path),
            "runs": self._record.session.runs,
        }
        self._steps = self._record.steps()
        self._next = next(self._steps, None)
        self._totals: bytes | None = None
        self._recounted: tuple[int, Totals] | None = None
        self._held = self._codec.silence()
        self._number = self._answered = 0
        self._open_spikes: int | None = None
        self._log = StepLog(image.cores, image.manifest.dt_s, self._unpacked, log)

    def _check_session(self, image: ChipImage, seed: int) -> None:
        """Refuse a record of another image or seed."""
        session = self._record.session
        if session.digest != image.digest:
            raise BackendError(
                f"{self._path}: a record of image {session.digest[:12]}, but the network is "
                f"image {image.digest[:12]}; play it back with the network it was made with"
            )
        if session.seed != seed:
            raise BackendError(
                f"{self._path}: a record of seed {session.seed}, but the run has seed {seed}; "
                f"cure: --seed {session.seed}"
            )

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Return the recorded outputs of this step; see `spikeport.backends.chip.Chip.step`.

        Raises
        ------
        BackendError
            If the chip is closed, the record ends here, or the host does not send what was
            recorded.
        """
        if self._closed:
            raise BackendError(CLOSED)
        recorded = self._next
        if recorded is None:
            raise self._end_error()
        sources = self._checks.checked(spikes, errors)
        self._number += 1
        self._compare(recorded, sources, errors)
        if self._open_spikes is None:  # else the board was late, and these were not sent to it
            self._open_spikes = len(sources)
        if recorded.answer is not None:
            try:
                stepped = self._codec.unpack_state(recorded.answer)
            except BodyError as error:
                raise BackendError(f"{self._path}: step {self._number}: {error}") from None
            self._held, self._totals = stepped.held, recorded.totals
            self._answered += 1
            self._log.append(stepped.counts, self._open_spikes)
            self._open_spikes = None
        self._next = next(self._steps, None)
        return self._held

    def _end_error(self) -> BackendError:
        """Return the error of a host that runs beyond the end of the record."""
        reason = "ends" if self._record.whole else "is cut or damaged"
        played_s = self._number * self._image.manifest.dt_s
        cure = f"; cure: run as long, --seconds {played_s:.12g}" if self._number else ""
        return BackendError(f"{self._path}: the record {reason} after step {self._number:,}{cure}")

    def _compare(
        self, recorded: RecordedStep, spikes: np.ndarray, errors: Mapping[int, np.ndarray]
    ) -> None:
        sent = self._codec.pack_step(spikes, errors)
        if sent == (recorded.sent, recorded.flags):
            return
        raise BackendError(
            f"{self._path}: step {self._number}: {self._difference(recorded, *sent)}"
        )

    def _difference(self, recorded: RecordedStep, body: bytes, flags: int) -> str:
        """Describe the difference between the host's message and the recorded one."""
        try:
            then, errors_then = self._codec.unpack_step(recorded.sent, recorded.flags)
        except BodyError as error:
            return str(error)
        now, errors_now = self._codec.unpack_step(body, flags)
        # Name the first source that differs: there may be too many to list.
        n = 1 + max(then.max(initial=0), now.max(initial=0))
        other = np.flatnonzero(np.bincount(then, minlength=n) != np.bincount(now, minlength=n))
        if other.size:
            first = other[0]
            sent, then_sent = (int(np.sum(spikes == first)) for spikes in (now, then))
            return (
                f"the host sends {sent} spikes of source {first}, and sent {then_sent} then; "
                f"{len(other)} sources differ ({len(now)} spikes now, {len(then)} then)"
            )
        groups = [
            group
            for group in sorted({*errors_now, *errors_then})
            if _bits_of(errors_now, group) != _bits_of(errors_then, group)
        ]
        return f"the host's learning errors for synapse groups {groups} differ from the record"

    def _unpacked(self) -> Totals:
        if self._totals is None:
            return self._counted_anew()
        try:
            return self._codec.unpack_totals(self._totals)
        except BodyError as error:
            raise BackendError(f"{self._path}: {error}") from None

    def _counted_anew(self) -> Totals:
        """Return totals that the record lacks; `link` says that the native chip counted them."""
        if self._recounted is None or self._recounted[0] != self._number:
            self._recounted = self._number, recounted(self._image, self._path, self._number)
        assert self.link is not None
        self.link["counted_by"] = "native"
        return self._recounted[1]

    def activity(self) -> Activity:
        """Return the counts; see `spikeport.backends.chip.Chip.activity`."""
        self._take_totals()
        return self._log.activity()

    def _take_totals(self) -> None:
        """Take the totals that the host asked for after the last step, if it did."""
        if self._next is None:
            self._totals = self._record.totals
        else:
            # If the log folds its counts in the next step, the host asks for totals after that
            # step's spikes were sent, so they include these spikes.
            folds = (self._answered + 1) % KEPT_STEPS == 0
            self._totals = None if folds else self._next.totals

    def close(self) -> None:
        """Close the record; see `spikeport.backends.chip.Chip.close`."""
        self._closed = True
        self._take_totals()
        try:
            self._log.close()  # raises where the record's counts are missing, or damaged
        finally:
            self._record.close()


def _bits_of(errors: Mapping[int, np.ndarray], group: int) -> bytes | None:
    """Return the bits of a group's error, so that 0.0 differs from -0.0; None without an error."""
    return np.asarray(errors[group], dtype=float).tobytes() if group in errors else None
