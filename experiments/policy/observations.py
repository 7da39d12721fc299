"""Observations that the ranges of a converted network are taken from."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport.errors import UsageError
from spikeport.networks.loading.mlp import Mlp
from spikeport.reading import npz
from spikeport.reading.mismatch import MismatchError

NAME = "observations"
N_NORMAL = 1000
CURE = "write it with: numpy.savez(file, observations=array)"


class Observations(NamedTuple):
    """Observations (m, n), and their origin in words."""

    values: np.ndarray
    origin: str


def read_observations(path: Path, n_inputs: int) -> Observations:
    """Read the array of an npz file: the one called ``observations``, or its only one.

    Raises
    ------
    UsageError
        If it is no such file, or its array does not hold finite numbers ``(m, n_inputs)``.
    """
    arrays = _arrays(path)
    if NAME not in arrays and len(arrays) != 1:
        raise _refusal(path, f"an array '{NAME}'", ", ".join(arrays) or "no array")
    values = arrays.get(NAME, next(iter(arrays.values())))
    if values.ndim != 2 or values.shape[1] != n_inputs or not len(values):
        raise _refusal(path, f"an array (m, {n_inputs})", f"shape {values.shape}")
    if values.dtype.kind not in "fiu" or not np.isfinite(values).all():
        raise _refusal(path, "finite numbers", "NaN, infinity or values that are not real numbers")
    return Observations(values.astype(float), f"{len(values):,} of {path}")


def normal_observations(mlp: Mlp) -> Observations:
    """Return normal values with the moments the policy was trained on, or else standard ones."""
    values = np.random.RandomState(0).standard_normal((N_NORMAL, mlp.sizes[0]))
    if mlp.trained_on is None:
        kind = "standard normal ones, without a file of observations"
    else:
        values = mlp.trained_on.mean + mlp.trained_on.std * values
        kind = "normal ones, with mean and deviation of its normalisation"
    return Observations(values, f"{N_NORMAL:,} {kind}")


def _arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        return npz.read(path)
    except MismatchError as error:
        raise UsageError(f"observations '{path}': {error}; {CURE}") from error


def _refusal(path: Path, expected: str, found: str) -> UsageError:
    return UsageError(f"observations '{path}': expected {expected}, found {found}; {CURE}")
