"""Decoders refitted to the activity of neurons on their backend, and the file that keeps them.

``spikeport calibrate`` writes the file; ``--set calibrated=FILE`` of ``spikeport run`` reads it.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeAlias

import nengo
import numpy as np
from numpy.typing import ArrayLike

from spikeport.cache import Arrays
from spikeport.compile.image.manifest import SCHEMA
from spikeport.errors import UsageError, printable
from spikeport.files import write_arrays
from spikeport.reading import npz
from spikeport.reading.mismatch import MismatchError, shown
from spikeport.reading.text import parse_json
from spikeport.simulator import Simulator

MADE_FOR, DIGEST, SCHEMA_KEY = "made_for", "image_digest", "image_schema"
DECODERS = "decoders/"
Shapes: TypeAlias = Mapping[str, tuple[int, ...]]
"""Shapes of decoders, by name."""


class Refitted(NamedTuple):
    """Decoders by name, and the digest of the image they were measured on."""

    decoders: dict[str, np.ndarray]
    image_digest: str

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the decoders and the digest as arrays, for a cache."""
        return {**self.decoders, DIGEST: np.array(self.image_digest)}

    @classmethod
    def of(cls, arrays: Arrays) -> "Refitted":
        """Return the decoders and the digest from arrays of a cache."""
        decoders = {name: D for name, D in arrays.items() if name != DIGEST}
        return cls(decoders, str(arrays[DIGEST]))

    def made_for(self, made_for: Mapping[str, object]) -> "DecoderCalibration":
        """Return the calibration of neurons that depend on ``made_for``."""
        return DecoderCalibration(made_for, self.image_digest, self.decoders)


@dataclass(frozen=True)
class DecoderCalibration:
    """Refitted decoders.

    Attributes
    ----------
    made_for : mapping of str
        The settings that the neurons depend on: the experiment, its own settings, chip and passes.
    image_digest : str
        Digest of the image the decoders were measured on; empty where no chip was involved.
    decoders : mapping of str to ndarray
        Refitted decoders, by name.
    """

    made_for: Mapping[str, object]
    image_digest: str
    decoders: Mapping[str, np.ndarray]

    def save(self, path: Path) -> None:
        """Write an npz file, whole or not at all."""
        arrays: dict[str, ArrayLike] = {DECODERS + name: D for name, D in self.decoders.items()}
        arrays |= {MADE_FOR: json.dumps(dict(self.made_for)), DIGEST: self.image_digest}
        arrays[SCHEMA_KEY] = SCHEMA
        write_arrays(path, arrays)


def no_neurons(calibrated: bool | str, what: str, cure: str) -> UsageError:
    """Return the error for a calibration that is asked for although ``what`` has no neurons."""
    asked = "true" if calibrated is True else calibrated
    return UsageError(
        f"calibrated={asked}: {what} has no neurons to calibrate; leave it out, or {cure}"
    )


def is_calibration(path: Path) -> bool:
    """Return whether a file is a calibration, whatever it was made for."""
    try:
        return MADE_FOR in npz.read(path)
    except MismatchError:
        return False


def load(path: Path, wanted: Mapping[str, object], shapes: Shapes) -> DecoderCalibration:
    """Read a calibration that `DecoderCalibration.save` wrote.

    Parameters
    ----------
    path : Path
        The file.
    wanted : mapping of str
        The settings that the neurons of the run depend on.
    shapes : mapping of str
        The shapes of the decoders, by name.

    Raises
    ------
    UsageError
        If the file holds something else, numbers that are not finite, decoders that were made
        for other settings than ``wanted``, or others than those of ``shapes``.
    """
    arrays = _read(path)
    made_for = _made_for(path, arrays)
    decoders = {k.removeprefix(DECODERS): D for k, D in arrays.items() if k.startswith(DECODERS)}
    if not all(D.dtype.kind == "f" and np.isfinite(D).all() for D in decoders.values()):
        raise _refusal(path, "NaN or infinity in it, or no numbers")
    found = DecoderCalibration(made_for, str(arrays[DIGEST]), decoders)
    # A file without the number of its method was made by the first method.
    held = {"method": 1, **made_for}
    # Further keys of the file do not matter here.
    other = [key for key in wanted if held.get(key) != wanted[key]]
    if other:
        raise _refusal(
            path, f"made for {_text(held, other)}, but the run has {_text(wanted, other)}"
        )
    _check_shapes(path, {name: D.shape for name, D in decoders.items()}, shapes)
    return found


def _check_shapes(path: Path, found: Shapes, wanted: Shapes) -> None:
    """Refuse decoders of other names or shapes than the run's."""
    if wrong := [name for name in found.keys() | wanted if found.get(name) != wanted.get(name)]:
        name = min(wrong)
        raise _refusal(
            path,
            f"decoders {shown(name)}: expected {_shape(wanted.get(name))}, found "
            f"{_shape(found.get(name))}",
        )


def _shape(shape: tuple[int, ...] | None) -> str:
    return "none" if shape is None else f"shape {shape}"


def _made_for(path: Path, arrays: Mapping[str, np.ndarray]) -> dict[str, object]:
    """Return the settings of the decoders; refuse a file that is no calibration of this schema."""
    # Files of schema 1 do not hold the number of their schema.
    schema = arrays.get(SCHEMA_KEY, np.array(1))
    try:
        made_for = parse_json(str(arrays[MADE_FOR]))
    except (KeyError, ValueError, RecursionError, MismatchError):
        made_for = None
    numbered = schema.shape == () and schema.dtype.kind in "iu"
    if not isinstance(made_for, dict) or DIGEST not in arrays or not numbered:
        raise _refusal(path, "no calibration in it")
    if int(schema) != SCHEMA:
        # Its digest is of an image in that schema, and images are no longer made in it.
        raise _refusal(path, f"made for image schema {schema}, this spikeport has {SCHEMA}")
    return made_for


def image_digest_of(sim: Simulator) -> str:
    """Return the digest of the image that runs; empty where no chip is involved."""
    return "" if sim.image is None else sim.image.digest


def play_in(node: nengo.Node, values: np.ndarray, steps: int, dt_s: float) -> None:
    """Feed values (m, d) to a node, each for ``steps`` steps, and the last one to the end."""

    def value(time_s: float) -> np.ndarray:
        # Nengo's time is the end of a step, so the first step is at dt.
        step = round(time_s / dt_s) - 1
        return np.asarray(values[min(step // steps, len(values) - 1)])

    source = nengo.Node(value, size_out=values.shape[1])
    nengo.Connection(source, node, synapse=None)


def _read(path: Path) -> dict[str, np.ndarray]:
    try:
        return npz.read(path)
    except MismatchError as error:
        raise _refusal(path, str(error)) from error


def _text(values: Mapping[str, object], keys: list[str]) -> str:
    return ", ".join(f"{shown(key)}={shown(values.get(key))}" for key in keys)


def _refusal(path: Path, found: str) -> UsageError:
    return UsageError(
        f"calibrated={path}: {printable(found)}; make it with `spikeport calibrate`, "
        "the settings of the run, and --out"
    )
