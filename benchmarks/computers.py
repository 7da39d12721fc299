"""Energy of runs on the chip, and of computers for the same controllers.

    spikeport run walk --set path=loop --out walk      # and any other runs
    OPENBLAS_NUM_THREADS=1 python benchmarks/computers.py walk [...] [--into docs/costs.md]

Times of the controllers in NumPy are CPU times of this machine. Its power is read from RAPL if RAPL
is readable, else assumed; the table says which.
"""

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import markdown_table
import numpy as np
from saved_runs import CALIBRATION
from timing import cpu_us

from spikeport.hardware_models.computers import BreakEven, OnChip, break_even, built_in
from spikeport.hardware_models.estimate import Estimate
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.path_following import exact_command
from spikeport.networks.walking_policy import load
from spikeport.robot.arm import ArmDynamics
from spikeport.robot.walk_interface import CONTROL_DT_S

RAPL = Path("/sys/class/powercap/intel-rapl:0")
ASSUMED_W = 10.0
"""Power of a core at work, if it cannot be measured: assumed, not a figure of this machine."""
ROUNDS = 7
LAW_DT_S = 0.005
"""Period of the arm's law, which is the step of the physics."""
WALKING, ARM = ("policy", "path follower"), ("arm's law",)
CONTROLLERS = {"reach": ARM, "draw": ARM, "walk": WALKING, "switch": (*WALKING, *ARM)}
"""The controllers of each experiment; the chip computes all of them all the time."""

Times = dict[str, tuple[float, float]]
"""CPU time in s and period in s of each controller."""


class Power(NamedTuple):
    """Power of this machine at work, in W, and the source of the figure."""

    watts: float
    source: str


def macs_of_policy() -> int:
    """Return the multiplications and additions of the walking policy."""
    return sum(W.size for W in load().weights)


def in_numpy() -> Times:
    """Return how long each controller takes in NumPy."""
    policy = load()
    law = OperationalSpaceLaw(ArmDynamics())
    rng = np.random.RandomState(0)
    observation, q = rng.randn(policy.weights[0].shape[1]), np.array([0.1, -0.2, 0.3, 0.4])
    dq, error = 0.1 * rng.randn(4), 0.1 * rng.randn(3)
    reference, state = rng.randn(4), rng.randn(5)
    microseconds = cpu_us(
        {
            "policy": lambda: policy(observation),
            "path follower": lambda: exact_command(policy.gains, reference, state),
            "arm's law": lambda: law.torque(q, dq, error),
        },
        ROUNDS,
    )
    periods = {"policy": CONTROL_DT_S, "path follower": CONTROL_DT_S, "arm's law": LAW_DT_S}
    return {name: (us / 1e6, periods[name]) for name, us in microseconds.items()}


def power() -> Power:
    """Return this machine's power by RAPL while it computes for a second, else assumed power."""
    try:
        before, begin = _energy_uj(), time.monotonic()
        policy, observation = load(), np.zeros(69)
        while time.monotonic() < begin + 1.0:
            policy(observation)
        joules = (_energy_uj() - before) % _range_uj() / 1e6
        return Power(joules / (time.monotonic() - begin), "RAPL, the whole package")
    except OSError:
        return Power(ASSUMED_W, "assumed: this machine has no RAPL that may be read")


def _energy_uj() -> int:
    return int((RAPL / "energy_uj").read_text())


def _range_uj() -> int:
    """Return the energy at which the counter is zero again."""
    return int((RAPL / "max_energy_range_uj").read_text()) + 1


def on_chip(result: dict[str, Any]) -> OnChip:
    """Return the cost of a run on the chip."""
    spent = result["energy"][CALIBRATION]
    steps = spent["n_steps"]
    terms = {term["event"]: term for term in spent["terms"]}
    operations = terms["synaptic_operation"]
    n, joules = operations["count"], operations["energy"]["value"]
    return OnChip(
        synaptic_operations=n / steps,
        synaptic_operation_j=joules / n if n else 0.0,
        other_j=(spent["dynamic_run"]["value"] - joules) / steps,
        static_w=spent["static"]["power"]["value"],
        dt_s=spent["period_s"],
    )


def units(results: dict[str, dict[str, Any]], times: Times, drawn: Power) -> str:
    """Return a table of the energy per unit of the robot's task, of each run and of NumPy here."""
    heads = (
        *("run", "unit", "dynamic, davies2018", f"dynamic, {CALIBRATION}", "static [interval]"),
        f"the same in NumPy, at {drawn.watts:g} W",
    )
    rows = [
        (
            name,
            f"a {unit}",
            _joules(by["davies2018"]["dynamic"]["value"]),
            _joules(by[CALIBRATION]["dynamic"]["value"]),
            _interval(by[CALIBRATION]["static"]),
            _joules(_load(result["experiment"], times) * drawn.watts * _seconds(result, unit)),
        )
        for name, result in results.items()
        for unit, by in result["energy_by_unit"].items()
    ]
    return markdown_table.table(heads, rows)


def _load(experiment: str, times: Times) -> float:
    """Return the share of time that this CPU computes an experiment's controllers."""
    return sum(times[name][0] / times[name][1] for name in CONTROLLERS[experiment])


def _seconds(result: dict[str, Any], unit: str) -> float:
    """Return the duration of a unit: its static energy over the static power."""
    static_j = result["energy_by_unit"][unit][CALIBRATION]["static"]["value"]
    return float(static_j / result["energy"][CALIBRATION]["static"]["power"]["value"])


def computers(times: Times, drawn: Power) -> str:
    """Return a table of the energy of a policy period on every computer."""
    macs = macs_of_policy()
    heads = ("computer", "operations", "at rest, 20 ms", "in all, 20 ms", "source")
    rows = [
        (
            one.name,
            _joules(one.for_macs(macs)),
            "in the first" if one.idle is None else _joules(one.idle.value * CONTROL_DT_S),
            _joules(one.in_period(macs, CONTROL_DT_S)),
            one.energy.source,
        )
        for one in built_in()
    ]
    seconds = times["policy"][0]
    here = f"{1e6 * seconds:.0f} us of CPU at {drawn.watts:g} W ({drawn.source})"
    rows.append(("this CPU, NumPy", _joules(seconds * drawn.watts), "not known", "not known", here))
    return markdown_table.table(heads, rows)


def where_equal(results: dict[str, dict[str, Any]]) -> str:
    """Return a table of the figures with which the chip would draw no more than each computer."""
    heads = ("run", "against", "synaptic operations a step", "dynamic a step", "static", "rate")
    macs = macs_of_policy()
    return markdown_table.table(
        heads,
        [
            (name, one.name, *_words(break_even(chip, one, macs, 1 / CONTROL_DT_S), chip))
            for name, result in results.items()
            if "policy period" in result["energy_by_unit"]
            for chip in [on_chip(result)]
            for one in built_in()
        ],
    )


def _words(found: BreakEven, chip: OnChip) -> Iterator[str]:
    """Yield each break-even figure, and the present one."""
    operations, dynamic_j, static_w, rate_hz = found
    now = chip.synaptic_operations
    yield "none" if operations is None else f"{operations:,.0f} (now {now:,.0f})"
    yield "none" if dynamic_j is None else f"{_joules(dynamic_j)} (now {_joules(chip.dynamic_j)})"
    yield (
        "none" if static_w is None else f"{1000 * static_w:,.2f} mW (now {1000 * chip.static_w:g})"
    )
    yield "any" if rate_hz is None else f"{rate_hz:,.0f} Hz (now {1 / CONTROL_DT_S:g})"


def operations(results: dict[str, dict[str, Any]]) -> Iterator[str]:
    """Yield the operations of a policy period, in words."""
    macs, steps = macs_of_policy(), round(CONTROL_DT_S / 0.001)
    for name, result in results.items():
        if "policy period" in result["energy_by_unit"]:
            n = steps * on_chip(result).synaptic_operations
            yield f"- {name}: {n:,.0f} synaptic operations, {n / macs:,.0f} times {macs:,}"


def _joules(value: float) -> str:
    return Estimate(value, None, None, "J", "").format().partition(" [")[0]


def _interval(estimate: dict[str, float]) -> str:
    low, high = _joules(estimate["low"]), _joules(estimate["high"])
    return f"{_joules(estimate['value'])} [{low}, {high}]"


def timed(times: Times, drawn: Power) -> str:
    """Return a table of the controllers in NumPy on this CPU."""
    heads = (
        "controller in NumPy",
        "CPU time",
        "period",
        f"energy at {drawn.watts:g} W",
        "a second",
    )
    rows = [
        (
            name,
            f"{1e6 * seconds:.0f} us",
            f"{1000 * period:g} ms",
            _joules(seconds * drawn.watts),
            _joules(seconds * drawn.watts / period),
        )
        for name, (seconds, period) in times.items()
    ]
    return markdown_table.table(heads, rows)


def on_a_chip(folder: str) -> tuple[str, dict[str, Any]]:
    """Return the name and the results of a run on the chip, from its folder."""
    path = Path(folder) / "result.json"
    try:
        found = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise argparse.ArgumentTypeError(f"{path}: {error}") from None
    if found.get("experiment") not in CONTROLLERS or not found.get("energy_by_unit"):
        raise argparse.ArgumentTypeError(
            f"{folder}: no run of {', '.join(CONTROLLERS)} on a chip; choose another folder"
        )
    return path.parent.name, found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, or write them into a document."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+", type=on_a_chip, help="folders of runs on the chip")
    parser.add_argument("--into", type=markdown_table.document)
    asked = parser.parse_args(arguments)
    results = dict(asked.runs)
    times, drawn = in_numpy(), power()
    parts = [
        units(results, times, drawn),
        "\n".join(operations(results)),
        timed(times, drawn),
        computers(times, drawn),
        where_equal(results),
    ]
    markdown_table.show("\n\n".join(part for part in parts if part), asked.into)


if __name__ == "__main__":
    main()
