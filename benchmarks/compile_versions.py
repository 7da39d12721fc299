"""CPU time and memory of compiles by this version, and by another one.

    git worktree add /tmp/old COMMIT && pip install --no-deps --target /tmp/old-site /tmp/old
    OPENBLAS_NUM_THREADS=1 python benchmarks/compile_versions.py /tmp/old-site [--network NAME]...

Each compile runs in a process of its own, and the versions take turns. CPU time is that of the
compile alone; memory is the growth of the process during it. ``import`` is the import of
`Simulator`. ``arm`` and ``humanoid`` are the networks of `run reach` and `run switch`; their time
is that of making the simulator, with its kernels already on disk.
"""

import contextlib
import itertools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import markdown_table
from arguments import at_least
from peak_memory import peak_bytes
from versions import EXPERIMENTS, HERE, new_parser

HEADS = ("network", "before, CPU s", "now, CPU s", "times", "before, MB", "now, MB")
RUNS = {"arm": "reach", "humanoid": "switch"}
"""Experiments whose networks are compiled, with decoders that are solved, not calibrated."""


def dense() -> Any:
    """Return 2,000 LIF neurons, each wired to all of 2,000 others."""
    import nengo
    import numpy as np

    with nengo.Network(seed=0) as network:
        pre, post = (nengo.Ensemble(2000, 1).neurons for _ in range(2))
        weights = 1e-4 * np.random.RandomState(0).randn(2000, 2000)
        nengo.Connection(pre, post, transform=weights)
        nengo.Probe(post[:1])
    return network


def policy() -> Any:
    """Return a walking policy of 3 layers of 128 ELU units, each two ensembles of 20 neurons."""
    import numpy as np

    from spikeport.networks import policy_values
    from spikeport.networks.policy import policy as build

    rng, sizes = np.random.RandomState(0), [69, 128, 128, 128, 19]
    layers = [
        policy_values.Layer(rng.randn(n, m) / np.sqrt(m), 0.1 * rng.randn(n))
        for m, n in itertools.pairwise(sizes)
    ]
    return build(layers, policy_values.record_ranges(layers, rng.randn(1000, 69)))


def chain() -> Any:
    """Return 256 ensembles of 500 neurons, each decoded into the next."""
    import cases

    return cases.chain(256, 500)


def decoded() -> Any:
    """Return 8,000 neurons that represent 16 values, decoded into 100."""
    import nengo
    import numpy as np

    with nengo.Network(seed=0) as network:
        ensemble = nengo.Ensemble(8000, 16, n_eval_points=2000)
        end = nengo.Node(size_in=100)
        nengo.Connection(ensemble, end, transform=np.random.RandomState(0).randn(100, 16) / 4)
        nengo.Probe(end)
    return network


NETWORKS: dict[str, tuple[Callable[[], Any], str]] = {
    "dense": (dense, "compact"),
    "policy": (policy, "compact"),
    "chain": (chain, "as_written"),
    "decoded": (decoded, "compact"),
}
"""Networks, and the pipelines that compile them."""


def measure(name: str) -> dict[str, float]:
    """Return CPU time and memory of one compile, in a process of its own."""
    if name == "import":
        begin = time.process_time()
        from spikeport import Simulator  # noqa: F401

        return {"cpu_s": time.process_time() - begin, "mb": 0.0}
    if name in RUNS:
        return _of_a_run(RUNS[name])
    from boards import board

    from spikeport import compile_network

    make, pipeline = NETWORKS[name]
    with tempfile.TemporaryDirectory() as folder:
        chip, network = board(Path(folder)), make()
        before, begin = peak_bytes(), time.process_time()
        compile_network(network, chip, pipeline=pipeline)
    return _found(begin, before)


def _of_a_run(experiment: str) -> dict[str, float]:
    """Return CPU time and memory of making the simulator of a run."""
    from spikeport.cli import main as command
    from spikeport.simulator import Simulator

    make: Any = Simulator.__init__
    found: dict[str, float] = {}

    class Made(Exception):  # noqa: N818, it is no error
        """The simulator has been made."""

    def timed(self: Simulator, *arguments: Any, **options: Any) -> None:
        before, begin = peak_bytes(), time.process_time()
        make(self, *arguments, **options)
        if self.compilation is not None:
            found.update(_found(begin, before))
            raise Made

    Simulator.__init__ = timed  # type: ignore[method-assign]
    with tempfile.TemporaryDirectory() as folder:
        os.environ["SPIKEPORT_CACHE"] = str(Path(folder, "cache"))  # empty, so nothing is reused
        sys.argv = ["spikeport", "run", experiment, *EXPERIMENTS[experiment]]
        sys.argv += ["--out", str(Path(folder, "run"))]
        with contextlib.suppress(Made):
            command()
    return found


def _found(begin: float, before: float) -> dict[str, float]:
    return {"cpu_s": time.process_time() - begin, "mb": (peak_bytes() - before) / 1e6}


def compare(name: str, old_site: str, repeats: int) -> tuple[str, ...]:
    """Return a row of the table: medians of both versions, which take turns.

    A first round does not count: it leaves kernels and bytecode of both versions on disk.
    """
    rounds = range(repeats + 1)
    _, *found = ([_in_process(folder, name) for folder in (old_site, HERE)] for _ in rounds)
    cpu_s, mb = (
        [statistics.median(one[key] for one in version) for version in zip(*found, strict=True)]
        for key in ("cpu_s", "mb")
    )
    times_faster = f"{cpu_s[0] / cpu_s[1]:.1f}"
    return name, *(f"{one:.1f}" for one in cpu_s), times_faster, *(f"{one:,.0f}" for one in mb)


def _in_process(folder: str, name: str) -> dict[str, float]:
    command = [sys.executable, "-W", "ignore", __file__, folder, "--serve", name]
    done = subprocess.run(
        command,
        env={**os.environ, "PYTHONPATH": folder},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(f"{folder}: {name} ended with code {done.returncode}, as said above")
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def main() -> None:
    """Compare the versions, or compile in one of them."""
    names = ["import", *RUNS, *NETWORKS]
    parser = new_parser(__doc__, "--network", names)
    parser.add_argument("--times", type=at_least(1), default=1)
    arguments = parser.parse_args()
    if arguments.serve:
        print(json.dumps(measure(arguments.serve)))
        return
    rows = []
    for name in arguments.network or names:
        rows.append(compare(name, arguments.old_site, arguments.times))
        print(*rows[-1], flush=True)
    print(markdown_table.table(HEADS, rows))


if __name__ == "__main__":
    main()
