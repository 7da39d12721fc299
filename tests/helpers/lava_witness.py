"""An image in the form for Lava: weights as matrices of mantissas, one for each exponent.

Lava weighs spikes by even mantissas of 8 bits and a sign, shifts their sum by the exponent, and
then by 6 bits more.
"""

import subprocess
from collections import defaultdict
from pathlib import Path

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import synapses_of

RUN = Path(__file__).with_name("lava_run.py")
SHIFT = 6
LARGEST = 256
STATE = ("u", "v", "spiked")


def ran_on_lava(
    python: Path, image: ChipImage, spikes: np.ndarray, folder: Path, stock: bool = False
) -> dict[str, np.ndarray]:
    """Return current, voltage and spikes after every step, (n_steps, n_compartments) each.

    Parameters
    ----------
    python : Path
        A Python that has Lava.
    image : ChipImage
        The image, without noise and learning.
    spikes : (n_steps, n_inputs) array
        The spikes that the host sends, 0 or 1.
    folder : Path
        A folder for files.
    stock : bool
        Use Lava's own neurons; the image has to suit them.
    """
    wiring, result = folder / "wiring.npz", folder / "result.npz"
    np.savez(wiring, host=spikes, stock=stock, **_settings(image), **_matrices(image))
    subprocess.run([python, RUN, wiring, result], check=True, cwd=folder, timeout=600)
    with np.load(result) as found:
        return {name: found[name] for name in STATE}


def _settings(image: ChipImage) -> dict[str, np.ndarray]:
    each, blocks, block = image.compartments, image.blocks, image.compartment_block
    assert not each.enable_noise.any()
    assert not image.learns.any()
    return {
        "decay_u": each.decay_u,
        "decay_v": each.decay_v,
        "bias": each.bias,
        "threshold": each.vth,
        "lowest": blocks.vmin[block],
        "highest": blocks.vmax[block],
        "delay": each.refract_delay,
    }


def _matrices(image: ChipImage) -> dict[str, np.ndarray]:
    """Return matrices of mantissas by exponent and origin; repeated synapses take several."""
    parts = defaultdict(list)
    exponents = [_exponent(weights) for weights in _weights_of_groups(image)]
    group_of_synapse = np.repeat(np.arange(len(image.groups)), _group_sizes(image))
    for reached in synapses_of(image):
        mine = group_of_synapse[reached.number]
        for group in np.unique(mine):
            some, exponent = mine == group, exponents[group]
            host = bool(reached.source[0] >= image.n_compartments)
            weight = _mantissas(image.synapses.weight[reached.number[some]], exponent)
            source = reached.source[some] - host * image.n_compartments
            parts[host, exponent].append((source, reached.target[some], weight))
    found: dict[str, np.ndarray] = {}
    number = 0
    for (host, exponent), pieces in parts.items():
        source, target, weight = (np.concatenate(column) for column in zip(*pieces, strict=True))
        layer = _occurrence(source, target)
        for one in range(layer.max(initial=-1) + 1):
            some = layer == one
            columns = {"source": source[some], "target": target[some], "weight": weight[some]}
            columns |= {"exponent": np.array(exponent), "from_host": np.array(host)}
            found |= {f"{name}_{number}": values for name, values in columns.items()}
            number += 1
    return found | {"n_matrices": np.array(number)}


def _group_sizes(image: ChipImage) -> np.ndarray:
    sizes: np.ndarray = np.diff(image.rows.start[image.groups.row_start])
    return sizes


def _weights_of_groups(image: ChipImage) -> list[np.ndarray]:
    return np.split(image.synapses.weight, np.cumsum(_group_sizes(image))[:-1])


def _exponent(weights: np.ndarray) -> int:
    """Return the largest exponent that leaves even mantissas, for weights that share it."""
    used = int(np.bitwise_or.reduce(np.abs(weights), initial=0))
    if used == 0:
        return 0
    return (used & -used).bit_length() - 2 - SHIFT


def _mantissas(weights: np.ndarray, exponent: int) -> np.ndarray:
    shift = exponent + SHIFT
    found: np.ndarray = weights >> shift if shift >= 0 else weights << -shift
    assert np.abs(found).max(initial=0) <= LARGEST
    # Lava shifts the sum: to the right this is exact only if no weight has less than a unit.
    assert exponent >= 0 or not (found & ((1 << -exponent) - 1)).any()
    return found.astype(np.int32)


def _occurrence(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the number, from 0, of each synapse among those of the same source and target."""
    order = np.lexsort((target, source))
    pairs = np.column_stack([source, target])[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    first = np.maximum.accumulate(np.where(new, np.arange(len(order)), 0))
    result = np.empty(len(order), dtype=np.int64)
    result[order] = np.arange(len(order)) - first
    return result
