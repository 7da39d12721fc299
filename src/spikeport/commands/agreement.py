"""The agreement of a NIR graph on the chip with NIR's own equations, population by population."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport.backends.host_loop import HostLoop
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.ground.names import Names
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.report import Report
from spikeport.counted import percent
from spikeport.errors import UsageError
from spikeport.networks.loading.nir.equations import run
from spikeport.networks.loading.nir.lateness import Lateness
from spikeport.networks.loading.nir.network import NirNetwork
from spikeport.networks.loading.nir.populations import PopulationGraph
from spikeport.reading import npz
from spikeport.reading.archive import MOST_NUMBERS
from spikeport.reading.mismatch import MismatchError

RANDOM = "random"
N_STEPS, SHARE, SEED = 256, 0.05, 0


class Agreement(NamedTuple):
    """The share of equal neuron-steps of a population, and its spikes."""

    name: str
    equal: float
    silent: float
    """The share that a network without spikes would reach."""
    spikes: int
    wanted: int


class Played(NamedTuple):
    """Spikes of inputs, (n_steps, size) each, and their origin in words."""

    rows: dict[str, np.ndarray]
    origin: str


def moved(network: NirNetwork, report: Report) -> set[str]:
    """Return the populations that ``--offload`` moved to the host."""
    names, offloaded = Names(network), {one.object for one in report.offloaded}
    return {name for name, one in network.populations.items() if names[one] in offloaded}


def measured(network: NirNetwork, compilation: Compilation, played: Played) -> Iterator[Agreement]:
    """Yield the agreement of each population on the chip, whose spikes are some steps late."""
    wanted = run(network.folded, played.rows)
    n_steps = len(next(iter(played.rows.values())))
    names, on_host = Names(network), moved(network, compilation.report)
    late = Lateness(network.folded, on_host).steps
    chip = _spikes(network, compilation, played.rows, n_steps + max(late.values()))
    for name, one in network.folded.populations.items():
        if one.spikes and name not in on_host:
            mine = compartments(compilation.image, names[network.populations[name]])
            found = chip[late[name] : late[name] + n_steps, mine]
            equal = float((found == wanted[name]).mean())
            silent = float((wanted[name] == 0).mean())
            yield Agreement(name, equal, silent, int(found.sum()), int(wanted[name].sum()))


def compartments(image: ChipImage, owner: str) -> np.ndarray:
    """Return the compartments of an ensemble, block after block."""
    blocks = [i for i, block in enumerate(image.manifest.blocks) if block.owner == owner]
    everything = np.arange(image.n_compartments)
    return np.concatenate([everything[part(image.blocks.start, i)] for i in blocks])


def _spikes(
    network: NirNetwork, compilation: Compilation, rows: Mapping[str, np.ndarray], n_steps: int
) -> np.ndarray:
    """Return the spikes of all compartments, (n_steps, n)."""
    image = compilation.image
    for name, feed in network.feeds.items():
        feed.play(rows[name], image.manifest.dt_s)
    chip = NativeChip(image, SEED)
    loop = HostLoop(compilation, chip, SEED)
    counts = np.zeros((n_steps + 1, image.n_compartments), dtype=np.int64)
    for step in range(n_steps):
        loop.step()
        counts[step + 1] = chip.state.spike_count
    loop.close()
    return np.diff(counts, axis=0)


def spikes_of(folded: PopulationGraph, text: str) -> Played:
    """Return spikes for the inputs of a graph: random ones, or spikes from a file.

    Raises
    ------
    UsageError
        If there is no input, or the file lacks an array of 0 and 1, (n_steps, size), for one.
    """
    sizes = {name: math.prod(shape) for name, shape in folded.inputs.items()}
    if not sizes:
        raise UsageError(f"--spikes {text}: the graph has no input; leave --spikes out")
    if text == RANDOM:
        rng = np.random.default_rng(SEED)
        rows = {name: rng.random((N_STEPS, n)) < SHARE for name, n in sizes.items()}
        origin = f"random: each source in {percent(SHARE)} of {N_STEPS} steps, from seed {SEED}"
        return Played({name: one.astype(float) for name, one in rows.items()}, origin)
    try:
        found = npz.read(Path(text))
        rows = {name: _rows(found, name, n) for name, n in sizes.items()}
        if len({len(one) for one in rows.values()}) != 1:
            raise MismatchError("the same number of steps for each input", "different numbers")
    except MismatchError as error:
        wanted = ", ".join(f"{name} (n_steps, {n})" for name, n in sizes.items())
        raise UsageError(f"{text}: {error}; give an npz with arrays of 0 and 1: {wanted}") from None
    return Played(rows, f"{text}, {len(next(iter(rows.values())))} steps")


def _rows(found: Mapping[str, np.ndarray], name: str, size: int) -> np.ndarray:
    if name not in found or found[name].dtype.kind not in "biuf":
        raise MismatchError(f"an array of numbers {name}", "none")
    values = found[name]
    if values.ndim < 1 or not len(values) or values.size != len(values) * size:
        wanted = f"{name} of shape (n_steps, {size}), of one step or more"
        raise MismatchError(wanted, f"{values.shape}")
    if values.size > MOST_NUMBERS:
        raise MismatchError(f"at most {MOST_NUMBERS:,} values in {name}", f"{values.size:,}")
    if (other := values[~np.isin(values, (0, 1))]).size:
        raise MismatchError(f"values of 0 and 1 in {name}", f"{other[0]:g}")
    return values.reshape(len(values), size).astype(float)
