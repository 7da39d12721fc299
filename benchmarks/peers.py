"""The native chip and other simulators: the same networks, the same spikes, a process for each.

    OPENBLAS_NUM_THREADS=1 python benchmarks/peers.py [--folder .referees/peers] [--peer NAME]...
        [--into docs/performance.md]

Every peer has an environment of its own, which ``make bench-peers`` installs. An absent peer is
left out, and listed with the reason from its log. Networks are compiled here, and all peers run the
integers of the image (`peers/traffic.py`). Times are CPU times of a step, without building,
compiling and the constant part of a call.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import cases
import markdown_table
import nengo
import numpy as np
from speed import machine, timed_extraction

from spikeport.atomic import write_text
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import synapses_of
from spikeport.compile.pipeline import compile_network

SCRIPTS = Path(__file__).parent / "peers"
RESULTS = Path(__file__).parent / "peers.json"
PEERS = ("nest", "snntorch", "nengo", "sanafe", "brian2")
OURS = ("native", "nengo-loihi")
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
TIMEOUT_S = 1200
ALL = 4095
"""The decay that leaves nothing of a current."""
HEADS = ("", "CPU us a step", "million events a second", "to nengo-loihi", "to native", "spikes")


class Case(NamedTuple):
    """A network, and the title of its table."""

    title: str
    network: nengo.Network


def scattered(n: int = 8000, fan_out: int = 47) -> Case:
    """Return a network whose neurons each have weights to some random neurons."""
    rng = np.random.RandomState(0)
    weights = cases.scattered(rng, n, fan_out, 0.5e-3, 1.5e-3)
    return Case(f"{n:,} neurons, random fan-out {fan_out}", _recurrent(rng, n, weights))


def dense(n: int = 640) -> Case:
    """Return a network whose neurons each have weights to all neurons."""
    rng = np.random.RandomState(0)
    weights = rng.uniform(2.5e-5, 7.5e-5, (n, n))
    return Case(f"{n:,} neurons, each wired to all: {n * n:,} weights", _recurrent(rng, n, weights))


def _recurrent(rng: np.random.RandomState, n: int, weights: Any) -> nengo.Network:
    """Return neurons driven by their biases, to 20 to 70 Hz each, and by each other."""
    with nengo.Network(seed=0) as network:
        group = nengo.Ensemble(
            n,
            1,
            neuron_type=nengo.SpikingRectifiedLinear(),
            gain=np.ones(n),
            bias=rng.uniform(20, 70, n),
        ).neurons
        nengo.Connection(group, group, transform=weights, synapse=None)
    return network


CASES: dict[str, Callable[[], Case]] = {make.__name__: make for make in (scattered, dense)}


def compiled(network: nengo.Network) -> ChipImage:
    """Return the image of a network, which may be too large, without currents that last.

    Without a filter, nengo-loihi's discretiser leaves 1/4096 of a current to the next step. Here
    nothing is left, so that peers only need integers.
    """
    with timed_extraction():
        image = compile_network(network, pipeline="").image
    lasting = np.full(image.n_compartments, ALL, dtype=np.int32)
    return replace(image, compartments=replace(image.compartments, decay_u=lasting)).checked


def traffic_of(image: ChipImage) -> dict[str, np.ndarray]:
    """Return the arrays of `peers/traffic.py`.

    Raises
    ------
    ValueError
        If the image's neurons do more than integrate and fire, so that peers would differ.
    """
    of = image.compartments
    if np.any(of.decay_v) or np.any(of.decay_u != ALL) or np.any(of.refract_delay > 1):
        raise ValueError("the image's neurons leak or rest; peers' do not")
    source, target, number = map(np.concatenate, zip(*synapses_of(image), strict=True))
    order = np.argsort(source, kind="stable")
    count = np.bincount(source, minlength=image.n_compartments)
    return {
        "start": np.append(0, np.cumsum(count)),
        "target": target[order],
        "weight": image.synapses.weight[number[order]],
        "bias": of.bias,
        "vth": of.vth,
    }


def contest(case: Case, pythons: dict[str, Path]) -> dict[str, Any]:
    """Run a network on all contestants, one after the other; end if the native chip fails."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        image = compiled(case.network)
        image.save(folder / "image.npz")
        arrays = traffic_of(image)
        np.savez(folder / "traffic.npz", allow_pickle=False, **arrays)
        found = {}
        for ours in OURS:
            found[ours] = _run(sys.executable, "image", folder, str(folder / "image.npz"), ours)
            print(case.title, ours, found[ours].get("step_s", found[ours]), flush=True)
            if reason := found["native"].get("failed"):
                sys.exit(f"{case.title}: native, which all others are compared with: {reason}")
        for peer, python in pythons.items():
            found[peer] = _run(str(python), peer, folder)
            print(case.title, peer, found[peer].get("step_s", found[peer]), flush=True)
    return _figures(case.title, np.diff(arrays["start"]), found)


def _run(python: str, script: str, folder: Path, *more: str) -> dict[str, Any]:
    """Run a contestant; return its result, or the reason why there is none."""
    result = folder / "result.json"
    result.unlink(missing_ok=True)
    command = [python, "-W", "ignore", SCRIPTS / f"run_{script}.py", folder / "traffic.npz", result]
    try:
        done = subprocess.run(
            [*map(str, command), *more],
            env={**os.environ, **ONE_THREAD},
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return {"failed": f"took more than {TIMEOUT_S} s"}
    if done.returncode or not result.exists():
        return {"failed": (done.stderr.strip().splitlines() or ["no reason"])[-1]}
    found: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
    return found


def _figures(title: str, fan_out: np.ndarray, found: dict[str, Any]) -> dict[str, Any]:
    """Return the figures as they are kept; events follow from native's spikes, as all are equal."""
    from_native = np.array(found["native"]["spikes"])
    figures = {}
    for name, one in found.items():
        if "failed" not in one:
            spikes = np.array(one.pop("spikes"))
            one["spikes"] = int(spikes.sum())
            one["same"] = "each" if np.array_equal(spikes, from_native) else ""
            one["same"] = one["same"] or ("sum" if spikes.sum() == from_native.sum() else "")
        figures[name] = one
    return {"title": title, "events": int(from_native @ fan_out), "contestants": figures}


def absent(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the peers that are not installed, each with the last line of its log."""
    for peer in PEERS:
        if not python_of(folder, peer).exists():
            log = folder / f"{peer}.log"
            lines = log.read_text(encoding="utf-8").strip().splitlines() if log.exists() else []
            yield peer, lines[-1] if lines else "not installed; make bench-peers does it"


def python_of(folder: Path, peer: str) -> Path:
    """Return the Python of a peer's environment."""
    return (folder / peer / "bin" / "python").absolute()


def table(results: dict[str, Any]) -> str:
    """Return the tables of all networks, and the machine that measured them."""
    parts = []
    for case in results["cases"].values():
        rows = list(_rows(case))
        parts += [f"**{case['title']}**", "", markdown_table.table(HEADS, rows), ""]
    failed = (one for case in results["cases"].values() for one in _failed(case))
    parts += [f"Not run: {what} ({why})." for what, why in (*results["absent"].items(), *failed)]
    host = results["machine"]
    return "\n".join([*parts, f"{host['processor']}, one thread; Python {host['python']}."])


def _rows(case: dict[str, Any]) -> Iterator[list[str]]:
    """Yield a row for each contestant, the fastest first."""
    ran = {name: one for name, one in case["contestants"].items() if "failed" not in one}
    for one in sorted(ran.values(), key=lambda one: one["step_s"]):
        same = {"each": "equal, neuron by neuron", "sum": "equal in sum"}.get(one["same"], "others")
        times = {name: other["step_s"] / one["step_s"] for name, other in ran.items()}
        yield [
            one["version"],
            f"{one['step_s'] * 1e6:,.0f}",
            f"{case['events'] / one['steps'] / one['step_s'] / 1e6:,.1f}",
            f"{times['nengo-loihi']:.3g}x" if "nengo-loihi" in times else "-",
            f"{times['native']:.2g}x",
            f"{one['spikes']:,}, {same}",
        ]


def _failed(case: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the contestants that failed, each with the network and the reason."""
    for name, one in case["contestants"].items():
        if "failed" in one:
            yield f"{name}, {case['title']}", one["failed"]


def main() -> None:
    """Run the installed peers, write the results, and print the tables or put them into a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path(".referees/peers"))
    parser.add_argument("--case", action="append", choices=sorted(CASES))
    parser.add_argument("--peer", action="append", choices=PEERS)
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--into", type=markdown_table.document)
    arguments = parser.parse_args()
    if (arguments.case or arguments.peer) and arguments.out == RESULTS:
        parser.error(f"--case, --peer: {RESULTS} has all of them; choose another file with --out")
    there = {peer: python_of(arguments.folder, peer) for peer in arguments.peer or PEERS}
    pythons = {peer: python for peer, python in there.items() if python.exists()}
    results = {
        "machine": machine(),
        "absent": dict(absent(arguments.folder)),
        "cases": {name: contest(CASES[name](), pythons) for name in arguments.case or CASES},
    }
    write_text(arguments.out, json.dumps(results, indent=2) + "\n")
    markdown_table.show(table(results), arguments.into)


if __name__ == "__main__":
    main()
