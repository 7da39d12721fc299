"""Differences between the chip and NIR's equations, population by population, in words."""

from collections.abc import Collection, Iterator

import numpy as np

from spikeport.constants import DECAY_UNITS
from spikeport.counted import counted, percent
from spikeport.networks.loading.nir.lateness import Lateness
from spikeport.networks.loading.nir.network import NirNetwork
from spikeport.networks.loading.nir.populations import Population
from spikeport.networks.loading.nir.units import all_parts
from spikeport.neurons import chip_decays

LOWEST = 2**23
"""The lower end of the chip's voltage, in units below zero."""


def differences(network: NirNetwork, moved: Collection[str] = ()) -> Iterator[tuple[str, str]]:
    """Yield each difference, after the name of its population or output.

    ``moved`` populations are on the host.
    """
    folded, late = network.folded, Lateness(network.folded, moved)
    for name, one in folded.populations.items():
        if name in moved:
            yield name, "moved to the host, where Nengo computes it in floating point"
            continue
        texts = (
            _on_chip(network, one, late.steps[name])
            if one.spikes
            else _on_host(one, late.steps[name])
        )
        yield from ((name, text) for text in (*texts, *_path_lengths(late, one)))
    for name in folded.outputs:
        for source, steps in late.output_leads(name):
            earlier = counted(steps, "step")
            yield name, f"values of {source} come {earlier} earlier than its latest ones"


def _on_host(one: Population, late: int) -> Iterator[str]:
    yield "computed on the host, in floating point: it reads spikes and sends none"
    yield f"its voltage is {counted(late, 'step')} late"
    if one.depth > 1 and one.constants().any():
        yield "in float, spikes reach it a step before its bias: `simulate` counts that as an error"


def _on_chip(network: NirNetwork, one: Population, late: int) -> Iterator[str]:
    mine = network.units[one.node.name]
    further = ", and the way to the host one more" if late > one.depth else ""
    yield f"spikes are {counted(late, 'step')} late: each connection takes one{further}"
    yield from _rounding(one)
    lowest = -LOWEST / mine.threshold.max()
    yield f"the voltage cannot fall below {lowest:.0f} thresholds; NIR's has no lower bound"
    if n_levels := len(np.unique(mine.threshold)) - 1:
        yield f"{n_levels + 1} thresholds, so that small weights keep more bits"
    connected = [part for _, part in all_parts(mine.weights, network.n_parts)]
    if len(connected) > len(mine.weights):
        yield f"weights are two synapses each: {sum(p.nnz for p in connected):,} synapses"
    if mine.at_once < 1:
        yield f"inputs wrap around if over {percent(mine.at_once)} of its weights act in one step"
    if mine.constants[0].any():
        yield f"its bias is a source on the host, which spikes in every step from {one.depth} on"
    if mine.correction.any():
        share = np.abs(mine.correction / mine.threshold).max()
        yield (
            f"the chip adds up to {percent(share)} of the threshold in each step, to make up for "
            "the rounding of the bias"
        )


def _rounding(one: Population) -> Iterator[str]:
    of = one.dynamics
    for name, decay, rounded in zip(
        ("current", "voltage"),
        (of.current_decay, of.voltage_decay),
        chip_decays(of.current_decay, of.voltage_decay),
        strict=True,
    ):
        error = np.abs(rounded / DECAY_UNITS - decay) / np.maximum(decay, 1 / DECAY_UNITS)
        if error.max() > 0:
            yield (
                f"{name} decays by {_range(rounded)}/{DECAY_UNITS} a step, up to "
                f"{percent(error.max())} off, and rounds towards 0"
            )
        if (n_decays := len(np.unique(decay))) > 1:
            yield f"{n_decays} {name} decays; each is a profile of its core"


def _path_lengths(late: Lateness, one: Population) -> Iterator[str]:
    for source, steps in late.leads(one):
        moved = f"{counted(abs(steps), 'step')} {'early' if steps > 0 else 'late'}"
        yield f"spikes of {source} arrive {moved}, relative to those on its longest path"


def _range(values: np.ndarray) -> str:
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
