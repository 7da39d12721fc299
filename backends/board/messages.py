"""Bodies of frames: spikes and errors of a step, the state of outputs, and totals of a run."""

import struct
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from spikeport.backends.board.frame import MOST_BODY
from spikeport.backends.step_log import MessageCounts, Totals
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from spikeport.hardware_models.activity import PER_STEP

SPIKES = struct.Struct("<IH")
"""Bytes of the spikes, and number of groups with learning errors."""
ERRORS = struct.Struct("<IH")
"""Number of a synapse group, and number of its errors."""
TOTALS = struct.Struct("<QI")
"""Spikes of read-outs, and number of pairs of cores between which there were messages."""
BITMAP = 2
"""The flag of a step whose spikes are a bit for each source, if that is shorter than a list."""
I32, U32, F64 = np.dtype("<i4"), np.dtype("<u4"), np.dtype("<f8")
OF_BYTE = np.unpackbits(np.arange(256, dtype=np.uint8)).astype(np.int32).reshape(256, 8)
"""The bits of each byte, the highest bit first."""
PAIR = np.dtype([("source", "<u4"), ("target", "<u4"), ("messages", "<u8")])


class BodyError(ValueError):
    """The error of a body whose content does not fit its frame."""


class StepAnswer(NamedTuple):
    """The answer to a step: the state of outputs, and the counts of `PER_STEP`, (6, n_cores)."""

    held: list[np.ndarray]
    counts: np.ndarray


class Codec:
    """The bodies of one image's frames, whose sizes follow from the image.

    Parameters
    ----------
    image : ChipImage
        The image that runs on the board.

    Raises
    ------
    BackendError
        If its outputs do not fit into a frame.
    """

    def __init__(self, image: ChipImage) -> None:
        self._n_inputs = image.n_inputs
        self._bitmap_bytes = -(-image.n_inputs // 8)
        self._spiking = np.zeros(image.n_inputs, dtype=bool)
        as_bits = [output.key == "spiked" for output in image.manifest.outputs]
        sizes = np.diff(image.outputs.start)
        n_spikes = int(sizes[as_bits].sum())
        n_values = int(sizes.sum()) - n_spikes
        # a state is packed in place: these arrays are views of its body, except for the spikes
        counts_at = 4 * n_values - (-n_spikes // 8)
        n_bytes = counts_at + 4 * len(PER_STEP) * image.n_cores
        if n_bytes > MOST_BODY:
            raise BackendError(
                f"the image's outputs take {n_bytes:,} bytes a step, limit {MOST_BODY:,}; cure: "
                "probe fewer neurons"
            )
        self._state = bytearray(n_bytes)
        self._values = np.frombuffer(self._state, I32, n_values)
        self._bits = np.frombuffer(self._state, np.uint8, counts_at - 4 * n_values, 4 * n_values)
        counts = np.frombuffer(self._state, U32, -1, counts_at)
        self._counts = counts.reshape(len(PER_STEP), image.n_cores)
        self._spikes = np.zeros((len(self._bits), 8), dtype=np.int32)
        self._views = list(self._laid_out(as_bits, sizes.tolist()))
        self._n_cores = image.n_cores

    def _laid_out(self, as_bits: list[bool], sizes: list[int]) -> Iterator[np.ndarray]:
        """Yield a view for each output, of the values or of the spikes."""
        ends = {False: 0, True: 0}
        for kind, n in zip(as_bits, sizes, strict=True):
            held = self._spikes.ravel() if kind else self._values
            yield held[ends[kind] : ends[kind] + n]
            ends[kind] += n

    def pack_step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> tuple[bytes, int]:
        """Return the body of a step and its flags; see `spikeport.backends.chip.Chip.step`.

        `HostChecks` has checked spikes and errors.

        Raises
        ------
        BackendError
            If the body does not fit into a frame.
        """
        sent, flags = self._pack_spikes(spikes)
        parts = [SPIKES.pack(len(sent), len(errors)), sent]
        for group, error in sorted(errors.items()):
            values = np.asarray(error, dtype=F64).ravel()
            parts += ERRORS.pack(group, len(values)), values.tobytes()
        body = b"".join(parts)
        if len(body) > MOST_BODY:
            raise BackendError(
                f"the host's {len(spikes):,} spikes and {len(errors):,} groups of errors take "
                f"{len(body):,} bytes a step, limit {MOST_BODY:,} of a link; cure: --backend native"
            )
        return body, flags

    def _pack_spikes(self, spikes: np.ndarray) -> tuple[bytes, int]:
        """Return spikes as bits or as a list, whichever is shorter, and the flag of that form."""
        # A listed spike takes 4 bytes.
        if 4 * len(spikes) > self._bitmap_bytes and (bits := self._as_bits(spikes)) is not None:
            return bits, BITMAP
        return np.sort(spikes).astype(U32).tobytes(), 0

    def _as_bits(self, spikes: np.ndarray) -> bytes | None:
        """Return a bit for each source; None if one spikes twice."""
        self._spiking.fill(False)
        self._spiking[spikes] = True
        bits = np.packbits(self._spiking).tobytes()
        return bits if int.from_bytes(bits).bit_count() == len(spikes) else None

    def unpack_step(self, body: bytes, flags: int) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Return the spikes and errors of a step.

        Raises
        ------
        BodyError
            If the body is cut, too long, or names a source that the image does not have.
        """
        try:
            size, n_groups = SPIKES.unpack_from(body)
            at, errors = SPIKES.size + size, {}
            for _ in range(n_groups):
                group, n = ERRORS.unpack_from(body, at)
                errors[group] = np.frombuffer(body, F64, n, at + ERRORS.size)
                at += ERRORS.size + 8 * n
            spikes = self._sources(body[SPIKES.size : SPIKES.size + size], flags)
        except BodyError:
            raise
        except (struct.error, ValueError):  # Python's messages do not name the body
            raise BodyError(
                f"the step's body is cut: {len(body)} bytes, fewer than its counts ask for"
            ) from None
        if at != len(body):
            raise BodyError(f"the step's body has {len(body)} bytes, but its counts give {at}")
        return spikes, errors

    def _sources(self, sent: bytes, flags: int) -> np.ndarray:
        if flags & BITMAP:
            sources = np.unpackbits(np.frombuffer(sent, np.uint8)).nonzero()[0]
            if len(sent) != self._bitmap_bytes or (sources.size and sources[-1] >= self._n_inputs):
                raise BodyError(
                    f"a bitmap of {len(sent)} bytes does not fit {self._n_inputs} sources"
                )
            return sources
        if len(sent) % U32.itemsize:
            raise BodyError(f"{len(sent)} bytes of spikes, expected a multiple of 4")
        spikes = np.frombuffer(sent, U32).astype(np.int64)
        if spikes.size and (spikes[-1] >= self._n_inputs or (spikes[1:] < spikes[:-1]).any()):
            raise BodyError(f"sources must ascend from 0 to {self._n_inputs - 1}")
        return spikes

    def pack_state(self, held: Iterable[np.ndarray], counts: np.ndarray) -> bytes:
        """Return the body of an answer: spikes as bits, other values and counts as 32 bits."""
        for view, values in zip(self._views, held, strict=True):
            view[:] = values
        self._bits[:] = np.packbits(self._spikes)
        self._counts[:] = counts
        return bytes(self._state)

    def unpack_state(self, body: bytes) -> StepAnswer:
        """Return the content of an answer, valid until the next; BodyError if its size is wrong."""
        if len(body) != len(self._state):
            raise BodyError(f"an answer of {len(body)} bytes, expected {len(self._state)}")
        self._state[:] = body
        # Look the bytes up in a table, in place: `unpackbits` would make an array in each step.
        # "clip" spares NumPy a buffer.
        OF_BYTE.take(self._bits, 0, self._spikes, "clip")
        return StepAnswer(self._views, self._counts.astype(np.int64))

    def silence(self) -> list[np.ndarray]:
        """Return the content of outputs before the first step: zeros."""
        self._values[:] = self._spikes[:] = 0
        return self._views

    def pack_totals(self, totals: Totals) -> bytes:
        """Return totals as bytes: only pairs of cores with messages between them."""
        between, from_host = totals.messages
        source, target = np.nonzero(between)
        pairs = np.empty(len(source), dtype=PAIR)
        pairs["source"], pairs["target"] = source, target
        pairs["messages"] = between[source, target]
        head = TOTALS.pack(totals.readout_spikes, len(pairs))
        return head + from_host.astype("<u8").tobytes() + pairs.tobytes()

    def unpack_totals(self, data: bytes) -> Totals:
        """Return totals; BodyError if they do not fit this image."""
        n = self._n_cores
        try:
            readout_spikes, n_pairs = TOTALS.unpack_from(data)
            from_host = np.frombuffer(data, "<u8", n, TOTALS.size).astype(np.int64)
            pairs = np.frombuffer(data, PAIR, n_pairs, TOTALS.size + 8 * n)
        except (struct.error, ValueError):
            raise BodyError(
                f"the totals are cut: {len(data)} bytes, fewer than their counts ask for"
            ) from None
        if len(data) != TOTALS.size + 8 * n + pairs.nbytes:
            raise BodyError(f"the totals have {len(data)} bytes, more than their counts ask for")
        if pairs["source"].max(initial=0) >= n or pairs["target"].max(initial=0) >= n:
            raise BodyError(f"the totals name a core above {n - 1}")
        between = np.zeros((n, n), dtype=np.int64)
        between[pairs["source"], pairs["target"]] = pairs["messages"]
        return Totals(MessageCounts(between, from_host), readout_spikes)
