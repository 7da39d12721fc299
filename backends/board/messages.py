"""Bodies of frames: the spikes and errors of a step, what outputs hold, and totals of a run."""

import struct
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from spikeport.backends.step_log import MessageCounts
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
"""The flag of a step whose spikes are a bit for each source, where that is shorter than a list."""
PAIR = np.dtype([("source", "<u4"), ("target", "<u4"), ("messages", "<u8")])


class BodyError(ValueError):
    """A body that is not what its frame says."""


class Stepped(NamedTuple):
    """The answer to a step: what each output holds, and the counts of `PER_STEP`, (6, n_cores)."""

    held: list[np.ndarray]
    counts: np.ndarray


class Totals(NamedTuple):
    """The messages of all steps, and the spikes of compartments that must not spike."""

    messages: MessageCounts
    readout_spikes: int


class Codec:
    """The bodies of one image's frames, whose sizes follow from the image.

    Parameters
    ----------
    image : ChipImage
        The image that runs on the board.
    """

    def __init__(self, image: ChipImage) -> None:
        self._n_inputs = image.n_inputs
        self._bitmap_bytes = -(-image.n_inputs // 8)
        keys = [output.key for output in image.manifest.outputs]
        sizes = np.diff(image.outputs.start).tolist()
        self._as_bits = [key == "spiked" for key in keys]
        self._n_values = sum(n for n, bits in zip(sizes, self._as_bits, strict=True) if not bits)
        self._n_spikes = sum(sizes) - self._n_values
        self._held = np.zeros(sum(sizes), dtype=np.int32)
        self._views = self._laid_out(sizes)
        self._n_cores = image.n_cores
        self._counts = 4 * self._n_values - (-self._n_spikes // 8)
        self._state_bytes = self._counts + 4 * len(PER_STEP) * self._n_cores

    def _laid_out(self, sizes: list[int]) -> list[np.ndarray]:
        """Return a view for each output: values lie before spikes."""
        ends = {False: 0, True: self._n_values}
        views = []
        for as_bits, n in zip(self._as_bits, sizes, strict=True):
            views.append(self._held[ends[as_bits] : ends[as_bits] + n])
            ends[as_bits] += n
        return views

    def pack_step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> tuple[bytes, int]:
        """Return the body of a step and its flags; see `spikeport.backends.chip.Chip.step`.

        Raises
        ------
        BackendError
            If a spike is of a source that the image does not have.
        """
        spikes = np.sort(spikes)
        if spikes.size and not 0 <= spikes[0] <= spikes[-1] < self._n_inputs:
            raise BackendError(
                f"spikes of sources {spikes[0]} to {spikes[-1]}; the image's inputs have "
                f"{self._n_inputs}, counted from 0"
            )
        if 4 * len(spikes) > self._bitmap_bytes:
            bits = np.zeros(self._n_inputs, dtype=bool)
            bits[spikes] = True
            sent, flags = np.packbits(bits).tobytes(), BITMAP
        else:
            sent, flags = np.asarray(spikes, dtype="<u4").tobytes(), 0
        parts = [SPIKES.pack(len(sent), len(errors)), sent]
        for group, error in sorted(errors.items()):
            values = np.asarray(error, dtype="<f8").ravel()
            parts += ERRORS.pack(group, len(values)), values.tobytes()
        return b"".join(parts), flags

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
                errors[group] = np.frombuffer(body, "<f8", n, at + ERRORS.size)
                at += ERRORS.size + 8 * n
            spikes = self._sources(body[SPIKES.size : SPIKES.size + size], flags)
        except (struct.error, ValueError) as error:
            raise BodyError(f"the step's body is cut or damaged: {error}") from None
        if at != len(body):
            raise BodyError(f"the step's body has {len(body)} bytes, its content {at}")
        return spikes, errors

    def _sources(self, sent: bytes, flags: int) -> np.ndarray:
        if flags & BITMAP:
            bits = np.unpackbits(np.frombuffer(sent, np.uint8))
            if len(sent) != self._bitmap_bytes or bits[self._n_inputs :].any():
                raise ValueError(f"a bitmap of {len(sent)} bytes for {self._n_inputs} sources")
            return np.flatnonzero(bits)
        spikes = np.frombuffer(sent, "<u4").astype(np.int64)
        if spikes.size and (spikes.max() >= self._n_inputs or (np.diff(spikes) <= 0).any()):
            raise ValueError(f"sources must ascend from 0 to {self._n_inputs - 1}")
        return spikes

    def pack_state(self, held: Iterable[np.ndarray], counts: np.ndarray) -> bytes:
        """Return the body of an answer: spikes as bits, other values and counts as 32 bits."""
        for view, values in zip(self._views, held, strict=True):
            view[:] = values
        values, spikes = self._held[: self._n_values], self._held[self._n_values :]
        bits = np.packbits(spikes != 0)
        parts = values.astype("<i4", copy=False), bits, counts.astype("<u4")
        return b"".join(part.tobytes() for part in parts)

    def unpack_state(self, body: bytes) -> Stepped:
        """Return the content of an answer, valid until the next one; BodyError if it is another."""
        if len(body) != self._state_bytes:
            raise BodyError(f"an answer of {len(body)} bytes, not {self._state_bytes}")
        n, at = self._n_values, 4 * self._n_values
        self._held[:n] = np.frombuffer(body, "<i4", n)
        bits = np.frombuffer(body, np.uint8, self._counts - at, at)
        self._held[n:] = np.unpackbits(bits, count=self._n_spikes)
        counts = np.frombuffer(body, "<u4", -1, self._counts).astype(np.int64)
        return Stepped(self._views, counts.reshape(len(PER_STEP), self._n_cores))

    def silence(self) -> list[np.ndarray]:
        """Return the content of outputs before the first step: zeros."""
        self._held[:] = 0
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
        """Return totals; BodyError if they are not those of this image."""
        n = self._n_cores
        try:
            readout_spikes, n_pairs = TOTALS.unpack_from(data)
            from_host = np.frombuffer(data, "<u8", n, TOTALS.size).astype(np.int64)
            pairs = np.frombuffer(data, PAIR, n_pairs, TOTALS.size + 8 * n)
        except (struct.error, ValueError) as error:
            raise BodyError(f"the totals are cut or damaged: {error}") from None
        if pairs["source"].max(initial=0) >= n or pairs["target"].max(initial=0) >= n:
            raise BodyError(f"the totals name a core above {n - 1}")
        between = np.zeros((n, n), dtype=np.int64)
        between[pairs["source"], pairs["target"]] = pairs["messages"]
        return Totals(MessageCounts(between, from_host), readout_spikes)
