"""CPU time from the start of a process to the first step of an experiment, and its goals.

    OPENBLAS_NUM_THREADS=1 python benchmarks/first_step.py [--experiment NAME]... [--n-neurons N]
        [--profile FILE]

Each experiment starts twice, each time in a new process: with an empty cache, so that everything
is made, and with the cache that the first run has left. numba's cache has the compiled kernels
before both runs, and Python's bytecode is there after the first, as in an installation. With
--profile, the second run's time by function goes to a file for `pstats`.
"""

import argparse
import cProfile
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import markdown_table
from arguments import at_least

GOALS_S = {"walk": (40, 5), "switch": (70, 5)}
"""Goals for the first run and the second, in CPU seconds."""
HEADS = ("run", "empty cache, CPU s", "goal", "warm cache, CPU s", "goal")


def serve(experiment: str, arguments: list[str], profile: str | None) -> None:
    """Run an experiment by its command up to its first step, and print the CPU time so far."""
    profiler = cProfile.Profile()
    if profile:
        profiler.enable()
    from spikeport.cli import main as command
    from spikeport.experiments import driver

    def stop(*_: object) -> None:
        spent_s = time.process_time()
        profiler.disable()
        if profile:
            profiler.dump_stats(profile)
        sys.stdout.flush()
        os.write(answers, str(spent_s).encode())
        os._exit(0)

    answers = os.dup(1)
    os.dup2(2, 1)  # commands print, too
    driver.perform = stop  # type: ignore[assignment]
    sys.argv = ["spikeport", "run", experiment, *arguments]
    command()


def first_step_s(experiment: str, folder: Path, settings: list[str], profile: Path | None) -> float:
    """Return the CPU time to the first step, in a process of its own, in s."""
    asked = ["--profile", str(profile)] if profile else []
    out = ["--out", str(folder / "run"), "--overwrite"]
    command = [sys.executable, "-W", "ignore", __file__, "--serve", experiment, *asked]
    environment = {**os.environ, "SPIKEPORT_CACHE": str(folder / "cache")}
    # An installation has bytecode: without it, every run compiles our sources.
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    done = subprocess.run(
        [*command, "--", *settings, *out],
        env=environment,
        stdout=subprocess.PIPE,
        check=True,
    )
    return float(done.stdout)


def main() -> None:
    """Measure, and print a table; or act as the measured run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--experiment", action="append", choices=GOALS_S)
    parser.add_argument("--n-neurons", type=at_least(1))
    parser.add_argument("--profile", type=Path)
    parser.add_argument("--serve", help=argparse.SUPPRESS)
    parser.add_argument("arguments", nargs="*", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        serve(asked.serve, asked.arguments, asked.profile)
        return
    settings = ["--set", f"n_neurons={asked.n_neurons}"] if asked.n_neurons else []
    rows = []
    for experiment in asked.experiment or GOALS_S:
        with tempfile.TemporaryDirectory() as name:
            first = first_step_s(experiment, Path(name), settings, None)
            second = first_step_s(experiment, Path(name), settings, asked.profile)
        goals = GOALS_S[experiment]
        title = " ".join((experiment, *settings))
        rows.append((title, f"{first:.1f}", str(goals[0]), f"{second:.1f}", str(goals[1])))
        print(*rows[-1], flush=True)
    print(markdown_table.table(HEADS, rows))


if __name__ == "__main__":
    main()
