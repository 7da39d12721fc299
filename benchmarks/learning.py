"""CPU time of a step of networks that learn by PES, native and in float Nengo, in turn.

OPENBLAS_NUM_THREADS=1 python -W ignore benchmarks/learning.py [--rounds N]
"""

import argparse

import nengo
from arguments import at_least
from cases import LEARNING
from timing import cpu_us

import spikeport


def main() -> None:
    """Measure both, and print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=at_least(1), default=15)
    arguments = parser.parse_args()
    for name, make in LEARNING.items():
        # A network for each: nodes may have a state, as the motor of `adaptive`.
        with (
            spikeport.Simulator(make()) as ours,
            nengo.Simulator(make(), progress_bar=False) as f,
        ):
            us = cpu_us({"native": ours.step, "float": f.step}, arguments.rounds)
        print(
            f"{name}: {us['native']:.0f} us a step, float Nengo {us['float']:.0f}, "
            f"{us['native'] / us['float']:.2f} of it",
            flush=True,
        )


if __name__ == "__main__":
    main()
