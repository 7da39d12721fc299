"""One loader against spoilt files: the outcomes are counted, and files that fail are kept."""

import random
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from spikeport.errors import SpikeportError
from tests.fuzz.loaders import Loader
from tests.fuzz.mutations import mutated

SECONDS = 10
"""The most CPU time that reading a file may take."""


@dataclass
class Tally:
    """The outcomes of spoilt files: how many were read or refused, and how others failed."""

    loaded: int = 0
    refused: int = 0
    failures: list[str] = field(default_factory=list)
    slowest_s: float = 0.0

    @property
    def tried(self) -> int:
        """The number of all files."""
        return self.loaded + self.refused + len(self.failures)


def good_files(loader: Loader, folder: Path) -> list[Path]:
    """Write a loader's good files, and load each of them."""
    folder.mkdir(parents=True, exist_ok=True)
    loader.write(folder)
    files = sorted(path for path in folder.iterdir() if path.suffix != ".data")
    for path in files:
        loader.load(path)
    return files


def fuzz(loader: Loader, files: Sequence[Path], mutations: int, seed: int, tally: Tally) -> None:
    """Spoil good files in turn, ``mutations`` times in all, and count the outcomes.

    A spoilt file lies beside the good one, so that it is left if Python itself crashes. A file
    that fails is kept, with its seed in its name.
    """
    for number in range(mutations):
        good = files[number % len(files)]
        rng = random.Random(f"{seed} {number} {good.name}")
        path = good.with_name(f"spoilt{good.suffix}")
        path.write_bytes(mutated(good.read_bytes(), rng))
        if failure := _failure(loader, path, tally):
            kept = path.rename(path.with_stem(f"{good.stem}-{seed}-{number}-failed"))
            tally.failures.append(f"{kept}: {failure}")


def _failure(loader: Loader, path: Path, tally: Tally) -> str:
    """Return how a file fails to be read or refused; an empty text if it does not."""
    start, refusal = time.process_time(), ""
    try:
        with warnings.catch_warnings(action="ignore"):
            loader.load(path)
    except SpikeportError as error:
        refusal = str(error)
        if path.name not in refusal or not refusal.replace("\n", "").isprintable():
            return f"no path, or other letters, in: {refusal!r}"
    except Exception as error:
        return repr(error)
    seconds = time.process_time() - start
    tally.slowest_s = max(tally.slowest_s, seconds)
    if seconds > SECONDS:
        return f"took {seconds:.0f} s"
    tally.refused, tally.loaded = tally.refused + bool(refusal), tally.loaded + (not refusal)
    return ""
