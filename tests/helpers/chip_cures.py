"""Cures for the limits of chips and of a user's budget, SP1xx to SP3xx.

Chips are small, so that networks can be small; without passes every block has its own core.
"""

import itertools
import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest import mock

import nengo
import numpy as np
from nengo.neurons import NeuronType

from spikeport.compile.check.memory import VARIABLE, over_memory
from spikeport.compile.check.verify import verify, verify_settings
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.image.usage import core_uses
from spikeport.compile.pipeline import compile_network
from spikeport.compile.report.budget import Budget
from spikeport.hardware_models import chip as chips
from tests.helpers.chip_files import chip_file
from tests.helpers.cured import Case, Check, compiled, network_of, on_host


def on(make: Callable[[], object], passes: str = "", **limits: int) -> Check:
    """Return a check by a compile for a chip with these limits."""

    def check() -> set[str]:
        with tempfile.TemporaryDirectory() as folder:
            chip = chip_file(Path(folder) / "small.toml", **limits)
            return compiled(make, str(chip), passes)()

    return check


def together(make: Callable[[], object], **limits: int) -> Check:
    """Return a check of the blocks of a network on one core of a chip with these limits."""

    def check() -> set[str]:
        image = compile_network(network_of(make), pipeline="").image
        blocks = replace(image.blocks, core=np.zeros_like(image.blocks.core))
        return _limits(replace(image, blocks=blocks), **limits)

    return check


def apart(make: Callable[[], object], **limits: int) -> Check:
    """Return a check of the blocks of a network, each on its own core."""
    return lambda: _limits(compile_network(network_of(make), pipeline="").image, **limits)


def _limits(image: ChipImage, **limits: int) -> set[str]:
    with tempfile.TemporaryDirectory() as folder:
        chip = chips.get(str(chip_file(Path(folder) / "small.toml", **limits)))
    found = [*verify(core_uses(image, chip), chip), *verify_settings(image, chip)]
    return {one.id for one in found}


def budgeted(make: Callable[[], object], budget: Budget, rate_hz: float = 100) -> Check:
    """Return a check of a budget, at a firing rate of all neurons."""

    def check() -> set[str]:
        compilation = compile_network(network_of(make), pipeline="")
        activity = expected_activity(compilation.image, Rates(rate_hz))
        found, _ = budget.exceeded(compilation.report, activity)
        return {one.id for one in found}

    return check


def fan_out(sizes: Sequence[int], targets: Sequence[int]) -> None:
    """Add ensembles, each wired to every target."""
    ends = [nengo.Ensemble(n, 1) for n in targets]
    for size in sizes:
        start = nengo.Ensemble(size, 1)
        for end in ends:
            weights = np.full((end.n_neurons, size), 1e-3)
            nengo.Connection(start.neurons, end.neurons, transform=weights)


def fan_in(largest: Sequence[float], sparse: bool = False) -> None:
    """Add an ensemble, and others that are wired to it, with these largest weights.

    If ``sparse``, the last of these is wired with a sparse transform.
    """
    end = nengo.Ensemble(8, 1)
    for i, weight in enumerate(largest):
        weights = weight * np.random.RandomState(i).uniform(0.5, 1, (8, 8))
        weights[0, 0] = weight
        transform: object = weights
        if sparse and i == len(largest) - 1:
            # No weight leads to the first neuron, so that targets need an index.
            transform = nengo.Sparse((8, 8), indices=[(1, 3), (5, 3)], init=weight)
        nengo.Connection(nengo.Ensemble(8, 1).neurons, end.neurons, transform=transform)


def read(sizes: Sequence[int]) -> None:
    """Add ensembles that are decoded into one target on the host."""
    target = nengo.Node(lambda t, x: None, size_in=1)
    for size in sizes:
        nengo.Connection(nengo.Ensemble(size, 1), target, function=lambda x: x / len(sizes))


def send(sizes: Sequence[int]) -> None:
    """Add a node on the host, and ensembles that each read a part of its values."""
    node, first = nengo.Node(np.zeros(sum(sizes))), 0
    for size in sizes:
        nengo.Connection(node[first : first + size], nengo.Ensemble(8, size))
        first += size


def decode(on_host: bool) -> None:
    a, b = nengo.Ensemble(30, 1), nengo.Ensemble(8, 1)
    if on_host:
        node = nengo.Node(lambda t, x: x, size_in=1)
        nengo.Connection(a.neurons, node, transform=np.full((1, 30), 1e-3))
        nengo.Connection(node, b)
    else:
        nengo.Connection(a, b)


def wired(n: int) -> None:
    """Connect the first n neurons of an ensemble to those of another."""
    a, b = nengo.Ensemble(30, 1), nengo.Ensemble(8, 1)
    nengo.Connection(a.neurons[:n], b.neurons, transform=np.full((8, n), 1e-3))


def twice() -> None:
    """Add two connections from the same neurons, each of which has an axon in both."""
    a, b = nengo.Ensemble(15, 1), nengo.Ensemble(8, 1)
    for weight in (1e-3, 2e-3):
        nengo.Connection(a.neurons, b.neurons, transform=np.full((8, 15), weight))


def ensembles(sizes: Sequence[int], connected: bool = False) -> None:
    made = [nengo.Ensemble(size, 1) for size in sizes]
    if connected:
        for before, after in itertools.pairwise(made):
            nengo.Connection(before, after)


def dense(sizes: Sequence[int] = (20,), kept: float = 1.0) -> None:
    """Add ensembles that are wired to themselves, with a share of the weights."""
    for size in sizes:
        weights = np.random.RandomState(0).rand(size, size) * 1e-2
        a, mask = nengo.Ensemble(size, 1), np.random.RandomState(1).rand(size, size) < kept
        transform: object = weights
        if kept < 1:
            indices = np.argwhere(mask)
            transform = nengo.Sparse((size, size), indices=indices, init=weights[mask])
        nengo.Connection(a.neurons, a.neurons, transform=transform)


def kinds(*types: NeuronType) -> None:
    for kind in types:
        nengo.Ensemble(4, 1, neuron_type=kind)


def rare(tau_ref_s: float) -> None:
    """Add an ensemble that spikes rarely, and another one."""
    nengo.Ensemble(
        4, 1, neuron_type=nengo.LIF(tau_ref=tau_ref_s), max_rates=nengo.dists.Uniform(5, 10)
    )
    nengo.Ensemble(4, 1)


def learning() -> None:
    """Add a block whose weights learn, which takes a format of its own, and a fixed one."""
    a, target = nengo.Ensemble(9, 1), nengo.Node(size_in=1)
    learned = nengo.Connection(a, target, learning_rule_type=nengo.PES())
    nengo.Connection(target, learned.learning_rule)
    dense((9,))


def learning_on_host() -> None:
    """Add the blocks of `learning`, with the learning ensemble on the host."""
    a, target = nengo.Ensemble(9, 1), nengo.Node(size_in=1)
    on_host(a)
    learned = nengo.Connection(a, target, learning_rule_type=nengo.PES())
    nengo.Connection(target, learned.learning_rule)
    dense((9,))


def in_memory(n: int, size: int, memory_gb: float = 0.5) -> Check:
    """Return a check of the memory estimate for a chain of n ensembles, with this much memory."""

    def check() -> set[str]:
        with mock.patch.dict(os.environ, {VARIABLE: str(memory_gb)}):
            network = network_of(partial(ensembles, [size] * n, connected=True))
            return {one.id for one in over_memory(network)}

    return check


SMALL = {"out_axons": 20, "in_axons": 1000}
INS = {"in_axons": 20}
SOFT = "softcore-ecp5-85f"
CASES = [
    Case(
        "SP101",
        "split the source ensemble into {parts}, or give it fewer connections",
        on(partial(fan_out, [10], [4, 4, 4]), **SMALL),
        (
            on(partial(fan_out, [5, 5], [4, 4, 4]), **SMALL),
            on(partial(fan_out, [10], [4, 4]), **SMALL),
        ),
    ),
    Case(
        "SP101",
        "send to fewer cores",
        on(partial(fan_out, [10], [4, 4, 4]), **SMALL),
        (on(partial(fan_out, [10], [12]), **SMALL),),
    ),
    Case(
        "SP101",
        "let the compiler split and pack",
        on(partial(fan_out, [10], [4, 4, 4]), **SMALL),
        (on(partial(fan_out, [10], [4, 4, 4]), passes="compact", **SMALL),),
    ),
    Case(
        "SP102",
        "split the source ensemble into {parts} that decode into the same target",
        lambda: on(partial(read, [30]), **INS)() & on(partial(send, [15]), **INS)(),
        (on(partial(read, [15, 15]), **INS), on(partial(send, [8, 7]), **INS)),
    ),
    Case(
        "SP102",
        "between neurons, connect fewer of them",
        on(partial(wired, 30), **INS),
        (on(partial(wired, 20), **INS),),
    ),
    Case(
        "SP102",
        "decode on the host",
        on(partial(decode, on_host=False), **INS),
        (on(partial(decode, on_host=True), **INS),),
    ),
    Case(
        "SP102",
        "let the compiler split and merge axons",
        on(twice, **INS),
        (on(twice, passes="compact", **INS),),
    ),
    Case(
        "SP103",
        "split the ensemble into {parts} that share its targets",
        on(partial(read, [30]), compartments=20),
        (on(partial(read, [15, 15]), compartments=20),),
    ),
    Case(
        "SP104",
        "split the ensemble into {parts}, or connect it more sparsely",
        on(dense, synapse_bits=3000),
        (
            on(partial(dense, [10, 10]), synapse_bits=3000),
            on(partial(dense, kept=0.1), synapse_bits=3000),
        ),
    ),
    Case(
        "SP104",
        "use a Sparse or Convolution transform",
        on(dense, synapse_bits=3000),
        (on(partial(dense, kept=0.1), synapse_bits=3000),),
    ),
    Case(
        "SP105",
        "use the same time constants and refractory period",
        together(partial(kinds, nengo.LIF(), nengo.LIF(tau_rc=0.1)), compartment_profiles=1),
        (together(partial(kinds, nengo.LIF(), nengo.LIF()), compartment_profiles=1),),
    ),
    Case(
        "SP106",
        "place blocks by their thresholds",
        together(partial(fan_out, [4], [4]), threshold_profiles=1),
        (apart(partial(fan_out, [4], [4]), threshold_profiles=1),),
    ),
    Case(
        "SP107",
        "place blocks by their weight formats",
        lambda: (
            together(learning, synapse_profiles=1)()
            & on(partial(fan_in, [0.1, 0.01]), synapse_profiles=1)()
            & on(partial(fan_in, [0.1, 0.1], sparse=True), synapse_profiles=1)()
        ),
        (
            apart(learning, synapse_profiles=1),
            on(partial(fan_in, [0.1, 0.1]), synapse_profiles=1),
        ),
    ),
    Case(
        "SP108",
        "place blocks by their settings",
        together(partial(kinds, nengo.LIF(), nengo.LIF(min_voltage=-1))),
        (apart(partial(kinds, nengo.LIF(), nengo.LIF(min_voltage=-1))),),
    ),
    Case(
        "SP109",
        "keep what learns on the host with net.config[ensemble].on_chip = False",
        compiled(learning, SOFT),
        (compiled(learning_on_host, SOFT),),
    ),
    Case(
        "SP110",
        "shorten tau_ref",
        compiled(partial(rare, 0.063)),
        (compiled(partial(rare, 0.062)),),
    ),
    Case(
        "SP201",
        "use fewer or smaller ensembles or fewer decoded connections, or at least {parts} times",
        lambda: (
            on(partial(ensembles, [9] * 3), cores=2)()
            & on(partial(ensembles, [9] * 2, connected=True), cores=2)()
            & on(partial(ensembles, [600, 1100]), cores=2)()
        ),
        (
            on(partial(ensembles, [9] * 2), cores=2),
            on(partial(ensembles, [600, 1000]), cores=2),
            on(partial(ensembles, [9] * 2, connected=False), cores=2),
            on(partial(ensembles, [9] * 3), cores=2, chips=2),
        ),
    ),
    Case(
        "SP201",
        "let the compiler fuse ensembles",
        on(partial(ensembles, [9] * 3), cores=2),
        (on(partial(ensembles, [9] * 3), "compact", cores=2),),
    ),
    Case(
        "SP201",
        "use fewer or smaller ensembles, or a larger FPGA",
        lambda: (
            compiled(partial(ensembles, [9] * 2), "softcore-up5k")()
            & compiled(partial(ensembles, [1100]), "softcore-up5k")()
        ),
        (
            compiled(partial(ensembles, [9]), "softcore-up5k"),
            compiled(partial(ensembles, [500]), "softcore-up5k"),
            compiled(partial(ensembles, [9] * 2), SOFT),
        ),
    ),
    Case(
        "SP202",
        "use fewer neurons or sparser connections, or a larger FPGA",
        compiled(partial(dense, [300] * 2), "softcore-ecp5-25f"),
        (
            compiled(partial(dense, [150] * 2), "softcore-ecp5-25f"),
            compiled(partial(dense, [300] * 2, kept=0.1), "softcore-ecp5-25f"),
            compiled(partial(dense, [300] * 2), SOFT),
        ),
    ),
    Case(
        "SP301",
        "use fewer or smaller ensembles or fewer decoded connections, or raise --max-cores",
        lambda: (
            budgeted(partial(ensembles, [9] * 3), Budget(cores=2))()
            & budgeted(partial(ensembles, [9] * 2, connected=True), Budget(cores=2))()
            & budgeted(partial(ensembles, [600, 1100]), Budget(cores=2))()
        ),
        (
            budgeted(partial(ensembles, [9] * 2), Budget(cores=2)),
            budgeted(partial(ensembles, [600, 1000]), Budget(cores=2)),
            budgeted(partial(ensembles, [9] * 2, connected=False), Budget(cores=2)),
            budgeted(partial(ensembles, [9] * 3), Budget(cores=3)),
        ),
    ),
    Case(
        "SP302",
        "lower the firing rates or the number of synapses read by a spike, or raise --max-power",
        budgeted(dense, Budget(power_w=0.1040025)),
        (
            budgeted(dense, Budget(power_w=0.1040025), rate_hz=1),
            budgeted(partial(dense, kept=0.1), Budget(power_w=0.1040025)),
            budgeted(dense, Budget(power_w=1)),
        ),
    ),
    Case(
        "SP302",
        "raise --max-power above {static}",
        budgeted(dense, Budget(power_w=0.0001)),
        (budgeted(dense, Budget(power_w=0.2)),),
    ),
    Case(
        "SP303",
        "compile with one block a core, `-p unpacked` or `-p compact_unpacked`, lower the firing",
        budgeted(dense, Budget(step_us=1)),
        (
            budgeted(partial(dense, [10, 10]), Budget(step_us=1)),
            budgeted(dense, Budget(step_us=1), rate_hz=1),
            budgeted(dense, Budget(step_us=1e6)),
        ),
    ),
    Case(
        "SP501",
        "compile it on a machine with {gb} GB to spare, or in parts: fewer ensembles",
        in_memory(3, 8000),
        (in_memory(3, 8000, memory_gb=100), in_memory(3, 800), in_memory(1, 8000)),
    ),
    Case(
        "SP501",
        "where the estimate is too high, set another limit, in GB, by the environment variable",
        in_memory(3, 8000),
        (in_memory(3, 8000, memory_gb=64),),
    ),
]
