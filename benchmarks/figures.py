"""Figures that the documents state: the runs behind them, and a check that they still agree.

    python benchmarks/figures.py run [NAME]...     # make figures: hours; goes on where it was
    python benchmarks/figures.py check             # make figures-check: seconds

`figure_runs` has the runs, `stated` makes sentences from their results. Each run has a folder in
``build/figures``, and a finished run is not repeated: delete its folder to measure again, as a
sweep of other code of spikeport asks for. The figures of results are kept in
``benchmarks/figures``, in the repository, so that anyone can compare. Speeds are not kept. Pictures
of the documents are replaced by those of their runs.
"""

import argparse
import difflib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from figure_runs import PICTURES, QUIET_POLICY, RUNS, TRAINING
from stated import STATED, Stated

ROOT = Path(__file__).parents[1]
FOLDERS, RESULTS = ROOT / "build" / "figures", ROOT / "benchmarks" / "figures"
KEPT = (
    *("experiment", "backend", "seconds", "seeds", "settings", "metrics", "image_digest"),
    *("resources", "cores", "energy", "timing", "energy_by_unit", "versions", "rows"),
)
"""The parts of a result, of a compile's report or of an evaluation that are kept."""
DETAILS = ("terms", "cores")
"""Parts of an estimate that no document states; they would be nine tenths of the kept figures."""
SPEED = "real_time_factor"

Results = list[dict[str, Any]]
"""The results of a run: one result, or one for each point of a sweep."""


class Differing(NamedTuple):
    """A sentence made from results that a document lacks, and the most similar line there."""

    document: str
    sentence: str
    closest: str


def results_in(folder: Path) -> Results:
    """Return the results in the folder of a command; an empty list if there are none.

    A run has one result, a sweep one for each point that is finished, an evaluation one for all its
    points, and a compile its report.
    """
    for pattern in ("result.json", "points/*.json", "report.json"):
        if files := sorted(folder.glob(pattern)):
            return [_kept(json.loads(file.read_text())) for file in files]
    return []


def _kept(result: dict[str, Any]) -> dict[str, Any]:
    kept = {key: result[key] for key in KEPT if key in result}
    for kind in ("energy", "timing"):
        if estimates := kept.get(kind):
            kept[kind] = {name: _without(one, DETAILS) for name, one in estimates.items()}
    if "metrics" in kept:
        kept["metrics"] = _without(kept["metrics"], (SPEED,))
    return kept


def _without(parts: dict[str, Any], names: Sequence[str]) -> dict[str, Any]:
    return {name: part for name, part in parts.items() if name not in names}


def run(names: Iterable[str]) -> int:
    """Carry out unfinished runs, and keep results and pictures; returns how many failed."""
    failed = 0
    for name in names:
        folder, command = FOLDERS / name, RUNS[name]
        # Sweeps and evaluations, which have a plan, try their missing and failed points again.
        if (folder / "sweep.json").exists() or not results_in(folder):
            if QUIET_POLICY in command and not (ROOT / QUIET_POLICY).exists():
                print(f"{name}: {QUIET_POLICY} is missing; make it with: {TRAINING}")
                failed += 1
                continue
            print(f"{name}: spikeport {command}", flush=True)
            # The last bits of solved decoders depend on the number of threads.
            alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
            line = [sys.executable, "-m", "spikeport", *command.split(), "--out", str(folder)]
            done = subprocess.run(line, cwd=ROOT, env=alone, check=False)
            failed += done.returncode != 0
            if done.returncode:
                continue
        elif not _is_of(folder, command):
            print(f"{name}: {folder} has a run of another command; delete it to run: {command}")
            failed += 1
            continue
        RESULTS.mkdir(exist_ok=True)
        text = json.dumps(results_in(folder), indent=1) + "\n"
        (RESULTS / f"{name}.json").write_text(text)
        if name in PICTURES:
            shutil.copyfile(folder / "figure.png", ROOT / PICTURES[name])
    return failed


def _is_of(folder: Path, command: str) -> bool:
    """Return whether a folder has the run of a command; compiles do not say what they are of."""
    file = folder / "result.json"
    if not file.exists():
        return True
    words: list[str] = json.loads(file.read_text())["command"]
    # The folder may have been made in another checkout.
    return words[1 : words.index("--out")] == command.split()


def read_results(folder: Path = RESULTS) -> dict[str, Results]:
    """Return the kept results, by run."""
    return {file.stem: json.loads(file.read_text()) for file in sorted(folder.glob("*.json"))}


def differing(stated: Stated, results: Mapping[str, Results], text: str) -> Iterator[Differing]:
    """Yield the sentences made from results that the text of a document lacks."""
    whole = _spaced(text)
    for sentence in stated.sentences(results):
        if not _has(whole, _spaced(sentence)):
            closest = difflib.get_close_matches(sentence, text.splitlines(), n=1, cutoff=0)
            yield Differing(stated.document, sentence, *closest)


def _has(text: str, sentence: str) -> bool:
    """Return whether a text has a sentence, and not as a part of longer numbers.

    Otherwise "10 falls" would state 0 falls.
    """
    begin = r"(?<![\d.,-])" if sentence[:1].isdigit() else ""
    end = r"(?!\d|[.,]\d)" if sentence[-1:].isdigit() else ""
    return re.search(begin + re.escape(sentence) + end, text) is not None


def _spaced(text: str) -> str:
    """Return a text with its line ends and spaces as single spaces."""
    return re.sub(r"\s+", " ", text)


def check(
    results: Mapping[str, Results], stated: Sequence[Stated] = STATED, root: Path = ROOT
) -> int:
    """Print statements that differ from the results or have none; returns 1 if there are any."""
    made, differ = 0, 0
    for one in stated:
        missing = [name for name in one.runs if name not in results]
        if missing:
            print(f"not run: {', '.join(missing)} ({one.name}, {one.document})")
            continue
        made += 1
        for found in differing(one, results, (root / one.document).read_text()):
            differ += 1
            print(f"{found.document}: {one.name}")
            print(f"  results: {found.sentence}")
            print(f"  closest: {found.closest}")
    print(f"{made} of {len(stated)} statements have results; {differ} sentences differ")
    return int(differ > 0 or made < len(stated))


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry out runs, or check the documents."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    runs = commands.add_parser("run", help="carry out what is missing")
    runs.add_argument("names", nargs="*", choices=[[], *RUNS])
    commands.add_parser("check", help="compare the documents with the results")
    asked = parser.parse_args(arguments)
    if asked.command == "run":
        return int(run(asked.names or RUNS) > 0)
    return check(read_results())


if __name__ == "__main__":
    sys.exit(main())
