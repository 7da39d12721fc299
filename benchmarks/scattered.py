"""CPU time of a chip with random wiring, with short runs stored as lists of targets and as runs.

    PYTHONPATH=. OPENBLAS_NUM_THREADS=1 python benchmarks/scattered.py [--neurons N] [--drive X]
        [--rounds N]

Every neuron is wired to 47 random others, and fires by its bias, which ``--drive`` multiplies. Both
chips run in turn, in one process.
"""

import argparse
import statistics
from functools import partial
from unittest import mock

import numpy as np
from arguments import at_least
from timing import cpu_us

from spikeport.backends.native import wiring
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts, Route

FAN_OUT, PER_CORE = 47, 1000
NO_SPIKES = np.zeros(0, dtype=np.int64)


def image(n: int, drive: int = 1) -> ChipImage:
    """Return the image of n neurons that drive each other, a thousand per core."""
    rng = np.random.RandomState(0)
    targets = [np.sort(rng.choice(n, FAN_OUT, replace=False)) for _ in range(n)]
    parts = [np.arange(first, min(first + PER_CORE, n)) for first in range(0, n, PER_CORE)]
    blocks, groups, routes = [], [], []
    for core, part in enumerate(parts):
        bias = drive * rng.randint(2**10, 2**13, len(part))
        blocks.append(Block(len(part), core, bias=bias, vth=2**16, decay_v=128))
        near = [of[(of >= part[0]) & (of <= part[-1])] - part[0] for of in targets]
        weights = [64 * rng.randint(-60, 60, (1, len(of))) for of in near]
        groups.append(Group(weights, indices=[of[np.newaxis] for of in near], block=core))
    for source, axons in enumerate(parts):
        routes += [Route(axons, group=core, block=source) for core in range(len(blocks))]
    made: ChipImage = Parts(blocks, groups, [], routes).image()
    return made


def main() -> None:
    """Measure both, and print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--neurons", type=at_least(FAN_OUT), default=8000)
    parser.add_argument("--drive", type=int, default=1)
    parser.add_argument("--rounds", type=at_least(1), default=15)
    arguments = parser.parse_args()
    wired, chips = image(arguments.neurons, arguments.drive), {}
    for name, short in (("runs", 0), ("lists", wiring.SHORT)):
        with mock.patch.object(wiring, "SHORT", short):
            chips[name] = NativeChip(wired, 0)
    found = cpu_us(
        {name: partial(chip.step, NO_SPIKES, {}) for name, chip in chips.items()},
        arguments.rounds,
    )
    events = statistics.mean(chips["lists"].activity().synaptic_operations.sum(axis=1))
    for name, us in found.items():
        print(f"{name}: {us:.1f} us a step, {events / us:.0f} million events a second")
    print(f"{events:,.0f} events a step, ratio {found['runs'] / found['lists']:.2f}")


if __name__ == "__main__":
    main()
