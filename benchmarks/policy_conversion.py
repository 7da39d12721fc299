"""Errors of a spiking policy's actions, by kind of units, by solver and by activation.

    OPENBLAS_NUM_THREADS=1 python benchmarks/policy_conversion.py [--seeds N] [--into docs/walk.md]

The shipped policy's recorded gait is played in, every observation held for 5 ms. Errors are rms
over all joints, divided by the standard deviation of the exact actions. The spiking actions are
compared with the exact ones some observations before, at the lag with the least error. Finished
runs stay in ``build/policy_conversion``, in a folder for each policy.
"""

import argparse
import functools
import json
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path

import markdown_table
import numpy as np
from arguments import at_least
from saved_runs import policy_key

from spikeport.atomic import write_text
from spikeport.experiments.options import Options
from spikeport.experiments.policy.calibration import (
    HOLD_S,
    SETTLING,
    Played,
    SpikingHalves,
    refit_lagged,
)
from spikeport.experiments.policy.conversion import PASSES
from spikeport.experiments.walk.gait import record_gait
from spikeport.networks.policy import (
    Layer,
    PolicyOptions,
    Readout,
    exact,
    policy,
    record_ranges,
    solved_layers,
)
from spikeport.networks.policy_solving import by_halves
from spikeport.networks.walking_policy import load

RESULTS = Path("build/policy_conversion") / policy_key(load())
SECONDS, FITTED = 32.0, 0.8
"""The length of gait, and the share of it that is fitted; the rest is for the errors."""
MOST_LAG = 8
"""The number of lags to try, in observations of 5 ms."""


@dataclass(frozen=True)
class Case:
    """One conversion, on one kind of neurons."""

    units: str
    solve: str = "unit"
    activation: str = "elu"
    backend: str = "native"

    def options(self) -> PolicyOptions:
        """Return the options that the policy is made with."""
        return PolicyOptions(units=self.units, solve=self.solve, activation=self.activation)

    @property
    def name(self) -> str:
        """The name of the case's files."""
        return "-".join(asdict(self).values())


UNITS = ("hybrid", "lif", "relu", "if")
CASES = (
    *(Case(units, solve) for solve in ("unit", "layer") for units in UNITS),
    *(Case(u, activation=a) for a in ("tanh", "silu", "gelu") for u in ("hybrid", "lif")),
    *(Case("bent", activation=a) for a in ("elu", "tanh", "silu", "gelu")),
    *(Case(units, backend="reference") for units in UNITS),
)
HEADS = ("activation", "units", "solved by", "neurons", "as solved", "read-out refitted")


@functools.cache
def shipped() -> tuple[tuple[Layer, ...], np.ndarray]:
    """Return the layers and recorded gait of the shipped policy."""
    gait = record_gait(load(), seconds=SECONDS)
    recorded = gait[: len(gait) // 2]  # without mirror images, which leak held-out data
    return load().layers, recorded


def measure(case: Case, seed: int) -> dict[str, float]:
    """Return the errors and delays of the actions, as the layers were solved, and after a refit."""
    layers, gait = shipped()
    options, fitted = case.options(), int(FITTED * len(gait))
    ranges = record_ranges(layers, gait[:fitted], activation_name=case.activation)
    asked = (layers, ranges, options, seed)
    build = functools.partial(policy, *asked, observations=gait[:fitted])
    last = solved_layers(*asked, gait[:fitted])[-1]
    solved = last if isinstance(last, Readout) else by_halves(last, options)
    # Bent units are one ensemble a layer, whose weights take more memory than `compact` allows.
    run = Options(1.0, backend=case.backend, pipeline=PASSES if case.units == "bent" else "compact")
    with closing(SpikingHalves(build, solved.weights.shape[1], run)) as spiking:
        halves = spiking.play(gait)
    wanted = exact(layers, gait, case.activation)[-1]
    played = Played(halves[:fitted], wanted[:fitted])
    refitted = refit_lagged(by_halves(layers[-1], options), played)
    return {
        **errors("solved", solved, halves[fitted:], wanted[fitted:]),
        **errors("refitted", refitted, halves[fitted:], wanted[fitted:]),
    }


def errors(name: str, readout: Readout, halves: np.ndarray, wanted: np.ndarray) -> dict[str, float]:
    """Return the least error over all lags, and the lag."""
    found, spread = halves @ readout.weights.T + readout.bias, np.sqrt(wanted.var(axis=0).mean())
    first, end = max(SETTLING, MOST_LAG), len(wanted)
    differences = [found[first:] - wanted[first - lag : end - lag] for lag in range(MOST_LAG)]
    rms = [float(np.sqrt(np.mean(error**2)) / spread) for error in differences]
    return {name: min(rms), f"{name}_lag_s": HOLD_S * int(np.argmin(rms))}


def result(case: Case, seed: int) -> dict[str, float]:
    """Return the errors of a case; finished ones are read from files."""
    file = RESULTS / f"{case.name}-{seed}.json"
    if not file.exists():
        write_text(file, json.dumps(measure(case, seed), indent=2))
    found: dict[str, float] = json.loads(file.read_text(encoding="utf-8"))
    return found


def row(case: Case, seeds: int) -> list[str]:
    """Return the errors of all seeds of a case, and the lag of the first."""
    found = [result(case, seed) for seed in range(seeds)]
    neurons = "float" if case.backend == "reference" else "chip"
    cells = []
    for key in ("solved", "refitted"):
        values, lag_s = ", ".join(f"{one[key]:.3f}" for one in found), found[0][f"{key}_lag_s"]
        cells.append(f"{values} ({1000 * lag_s:.0f} ms)")
    return [case.activation, case.units, case.solve, neurons, *cells]


def main() -> None:
    """Measure the missing cases; print the table, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=at_least(1), default=1)
    parser.add_argument("--into", type=markdown_table.document)
    chosen = parser.parse_args()
    markdown_table.show(
        markdown_table.table(HEADS, (row(case, chosen.seeds) for case in CASES)), chosen.into
    )


if __name__ == "__main__":
    main()
