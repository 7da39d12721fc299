"""CPU time of a step of `run reach`, `walk` and `switch`, by this version and by another one.

    git worktree add /tmp/old COMMIT && pip install --no-deps --target /tmp/old-site /tmp/old
    OPENBLAS_NUM_THREADS=1 python benchmarks/versions.py /tmp/old-site [--experiment NAME]...

Each version runs in a process of its own, and blocks of steps take turns, so that other load on
the machine affects both. Physics are part of a step, and the converted policy is not calibrated.
"""

import contextlib
import os
import statistics
import subprocess
import sys
import tempfile
import time
from argparse import SUPPRESS, ArgumentParser, ArgumentTypeError
from collections.abc import Collection
from pathlib import Path
from typing import IO

from arguments import at_least

EXPERIMENTS = {
    "reach": ["--seconds", "1000"],
    "walk": ["--seconds", "1000", "--set", "calibrated=false", "--set", "n_neurons=20"],
    "switch": ["--set", "calibrated=false", "--set", "n_neurons=20"],
}
"""Options of the runs; n_neurons is named, since its default is not the same in all versions."""
BLOCK = 200
"""Steps that a version runs before it is the other's turn."""
HERE = str(Path(__file__).parents[1] / "src")


def site(folder: str) -> str:
    """Return a folder if it holds a version; otherwise this one would be compared with itself."""
    if not Path(folder, "spikeport", "__init__.py").is_file():
        cure = f"install one with pip install --no-deps --target {folder} CHECKOUT"
        raise ArgumentTypeError(f"{folder}: contains no spikeport; {cure}")
    return folder


class Version:
    """A process that runs an experiment with the package in a folder, block by block."""

    def __init__(self, folder: str, experiment: str) -> None:
        self._folder, self._out = folder, tempfile.TemporaryDirectory()
        served = ["--serve", experiment, "--out", self._out.name]
        self._process = subprocess.Popen(
            [sys.executable, "-W", "ignore", __file__, folder, *served],
            env={**os.environ, "PYTHONPATH": folder},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def block(self) -> float:
        """Return the CPU time of a step, in us, over the next block; end if the run has ended."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write("\n")
            self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            sys.exit(
                f"{self._folder}: its run has ended; see the error above, or give fewer --blocks"
            )
        return float(answer)

    def close(self) -> None:
        """End the process, and remove its run."""
        self._process.kill()
        self._process.wait()
        self._out.cleanup()


class Turns:
    """The stepping side of a `Version`, which waits for its turn before each block."""

    def __init__(self, orders: IO[str], answers: IO[str]) -> None:
        self._orders, self._answers = orders, answers
        self._n, self._begin = 0, 0.0

    def step(self) -> None:
        """Begin a step."""
        if self._n % BLOCK == 0:
            if self._n:
                us = (time.process_time() - self._begin) / BLOCK * 1e6
                print(us, file=self._answers, flush=True)
            if not self._orders.readline():
                os._exit(0)
            self._begin = time.process_time()
        self._n += 1


def run_experiment(name: str, out: str, turns: Turns) -> None:
    """Run an experiment by its command, into a folder; steps of its rehearsals do not count."""
    from spikeport.cli import main as command
    from spikeport.simulator import Simulator

    step = Simulator.step

    def counted(self: Simulator) -> None:
        if self.compilation is not None:
            turns.step()
        step(self)

    Simulator.step = counted  # type: ignore[method-assign]
    options = ["--out", str(Path(out, "run")), "--overwrite"]
    sys.argv = ["spikeport", "run", name, *EXPERIMENTS[name], *options]
    command()


def compare(experiment: str, old_site: str, blocks: int) -> str:
    """Return a line with both versions' medians and tenth percentiles, and the ratios."""
    with (
        contextlib.closing(Version(old_site, experiment)) as before,
        contextlib.closing(Version(HERE, experiment)) as now,
    ):
        for version in (before, now):  # compiled and warm before anything counts
            version.block()
        found = [[version.block() for version in (before, now)] for _ in range(blocks)]
    times = [sorted(one) for one in zip(*found, strict=True)]
    old, new = (statistics.median(one) for one in times)
    old_p10, new_p10 = (one[len(one) // 10] for one in times)
    return (
        f"{experiment}: {old:.1f} -> {new:.1f} us a step, {old / new:.2f} times "
        f"(p10 {old_p10:.1f} -> {new_p10:.1f}, {old_p10 / new_p10:.2f} times)"
    )


def new_parser(description: str | None, option: str, names: Collection[str]) -> ArgumentParser:
    """Return a parser of the other version's folder and of the names to compare.

    ``--serve`` is for the processes of the versions: each gets one of the names.
    """
    parser = ArgumentParser(description=description)
    parser.add_argument("old_site", type=site, help="folder with the other version")
    parser.add_argument(option, action="append", choices=names)
    parser.add_argument("--serve", choices=names, help=SUPPRESS)
    return parser


def main() -> None:
    """Compare the versions, or run as one of them."""
    parser = new_parser(__doc__, "--experiment", EXPERIMENTS)
    parser.add_argument("--blocks", type=at_least(1), default=30)
    parser.add_argument("--out", help=SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve:
        answers = os.fdopen(os.dup(1), "w")
        os.dup2(2, 1)  # commands print, too
        run_experiment(arguments.serve, arguments.out, Turns(sys.stdin, answers))
        return
    for experiment in arguments.experiment or EXPERIMENTS:
        print(compare(experiment, arguments.old_site, arguments.blocks), flush=True)


if __name__ == "__main__":
    main()
