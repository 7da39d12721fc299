"""``python -m tests.fuzz``: fuzz all loaders for a given time, in rounds of a hundred files."""

import argparse
import tempfile
import time
from pathlib import Path

from tests.fuzz.fuzzing import Tally, fuzz, good_files
from tests.fuzz.loaders import LOADERS

ROUND = 100


def main() -> int:
    """Fuzz the loaders in turn, print a table, and return 1 if a file failed, else 0."""
    asked = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    asked.add_argument("--seconds", type=float, default=60.0)
    asked.add_argument("--loader", action="append", choices=list(LOADERS), help="default: all")
    asked.add_argument("--seed", type=int, default=0, help="of the first round")
    given = asked.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="spikeport-fuzz-"))
    names = given.loader or list(LOADERS)
    files = {name: good_files(LOADERS[name], folder / name) for name in names}
    tallies = {name: Tally() for name in names}
    seed, end = given.seed, time.monotonic() + given.seconds
    while time.monotonic() < end:
        for name in names:
            fuzz(LOADERS[name], files[name], ROUND, seed, tallies[name])
        seed += 1
    print(f"files: {folder}; next seed: {seed}")
    for name, tally in tallies.items():
        print(
            f"{name:12} tried {tally.tried:7,}  loaded {tally.loaded:7,}  refused "
            f"{tally.refused:7,}  failed {len(tally.failures):4,}  slowest {tally.slowest_s:.1f} s"
        )
        print(*tally.failures, sep="\n", end="\n" if tally.failures else "")
    return int(any(tally.failures for tally in tallies.values()))


if __name__ == "__main__":
    raise SystemExit(main())
