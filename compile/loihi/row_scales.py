"""The powers of two by which rows of weights are scaled, and the errors that rounding leaves.

The pass `scale_rows` scales the compartments of a block. Before there are any blocks, `decode_path`
asks here for the errors that a group of weights would have in one.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sparse
from nengo_loihi.block import Compartment

from spikeport.compile.loihi.discretise import scaled_info, stored
from spikeport.neurons import UNIT

LEAST = 2.0**-12
"""The share of the block's largest weight below which weights do not count: numbers that are 0
up to rounding are scattered over all magnitudes, and a threshold has 17 bits."""


def exponents(compartment: Compartment, largest: np.ndarray, profiles: int) -> np.ndarray:
    """Return the k of each compartment, (n,), with at most ``profiles`` different values.

    They are 0 if compartments have noise or a lower bound of the voltage other than zero, which are
    the same for a whole block, or if their thresholds differ already.

    Compartments with k = 0 keep their threshold. If it is large beside the weights, it limits the
    block's scale: scaled compartments would lose bits, and others gain none. Then k is smaller, or
    0.

    Parameters
    ----------
    compartment : Compartment
        The compartments of a block, in floating point.
    largest : (n,) array
        The largest absolute weight into each compartment.
    profiles : int
        The most thresholds in the block.
    """
    wanted = _wanted(largest)
    if not wanted.any() or not _is_plain(compartment):
        return np.zeros_like(wanted)
    unscaled = _weight_exponent(compartment, largest, np.zeros_like(wanted))
    for most in range(wanted.max(), 0, -1):
        k = _thinned(wanted.clip(max=most), profiles)
        if _weight_exponent(compartment, largest, k) >= unscaled:
            return k
    return np.zeros_like(wanted)


def _is_plain(compartment: Compartment) -> bool:
    alike = np.unique(compartment.vth).size == 1 and compartment.vmin == 0
    return alike and not compartment.enable_noise.any()


def _weight_exponent(compartment: Compartment, largest: np.ndarray, k: np.ndarray) -> float:
    """Return the exponent of the largest weights, if compartments are scaled by 2^-k.

    It is 0, less if a threshold or a bias leaves the weights fewer than 8 bits, and minus infinity
    if no scale fits all numbers.
    """
    info = scaled_info(compartment, largest, k)
    if info is None:
        return -np.inf
    most = (largest * np.exp2(-k).astype(np.float32)).max(initial=0.0)
    # A largest weight that was assumed to be larger has lost bits, too.
    exponent: float = info["w_exp"] - np.log2(info["w_max"] / most) if most else 0.0
    return exponent


def _wanted(largest: np.ndarray) -> np.ndarray:
    """Return the k, (n,), that bring the largest weights into all compartments to one size.

    This size is the 10 % quantile of the largest weights, so that outliers cost no profiles.
    """
    used = largest[largest > LEAST * largest.max(initial=0)]
    if used.size == 0:
        return np.zeros(len(largest), dtype=int)
    with np.errstate(divide="ignore"):
        k = np.floor(np.log2(largest / np.quantile(used, 0.1))).clip(min=0)
    result: np.ndarray = k.astype(int)
    return result


def _thinned(k: np.ndarray, profiles: int) -> np.ndarray:
    """Round k down to fewer different values, since a core has few threshold profiles."""
    step = -(-(k.max() + 1) // profiles)
    result: np.ndarray = k // step * step
    return result


@dataclass(frozen=True)
class RowScales:
    """The scales of a block's rows of weights on the chip.

    Attributes
    ----------
    k : (n,) array
        The powers of two by which weights and thresholds are divided.
    info : mapping
        The scales of the discretiser.
    vth : (n,) array
        The thresholds, in floating point.
    """

    k: np.ndarray
    info: Mapping[str, Any]
    vth: np.ndarray

    @classmethod
    def of(cls, compartment: Compartment, largest: np.ndarray, profiles: int) -> "RowScales | None":
        """Return the scales that a block gets, see `exponents`; None if none fits its numbers."""
        k = exponents(compartment, largest, profiles)
        info = scaled_info(compartment, largest, k)
        return None if info is None else cls(k, info, compartment.vth)

    def lost(self, weights: sparse.csr_array) -> sparse.csr_array:
        """Return what a group of weights (n, n_pre) gains and loses by rounding, (n, n_pre)."""
        lost = self.rounded(weights).data - weights.data
        return sparse.csr_array((lost, weights.indices, weights.indptr), shape=weights.shape)

    def rounded(self, weights: sparse.csr_array) -> sparse.csr_array:
        """Return a group of weights (n, n_pre) as the chip rounds them, (n, n_pre)."""
        rows = np.repeat(np.arange(weights.shape[0]), np.diff(weights.indptr))
        factor = np.exp2(-self.k).astype(np.float32)[rows]
        found = stored(weights.data * factor, rows, self.info) / factor
        return sparse.csr_array((found, weights.indices, weights.indptr), shape=weights.shape)

    def coarseness(self) -> float:
        r"""Return the relative rms error of thresholds, which are multiples of 64.

        .. math:: e^2 = \langle (64 / \theta_n)^2 / 12 \rangle_n
        """
        thresholds = self.vth * np.exp2(-self.k) * self.info["v_scale"]
        return float(np.sqrt(np.mean((UNIT / thresholds) ** 2) / 12))
