"""Figures that the documents state: the runs behind them, and a check that they still agree.

    python benchmarks/figures.py run [NAME]...     # make figures: hours; goes on where it was
    python benchmarks/figures.py check             # make figures-check: seconds

``run`` ends with 3 if nothing failed, but runs lacked a policy that is not in the repository.
`figure_runs` has the runs, `stated` makes sentences from their results. Each run has a folder in
``build/figures``, and a finished run is not repeated: delete its folder to measure again, as a
sweep of other code of spikeport asks for. The figures of results are kept in
``benchmarks/figures``, in the repository, so that anyone can compare; results of a folder are kept
once, so that they replace no newer ones. Speeds are not kept. Pictures of the documents are
replaced by those of their runs.
"""

import argparse
import difflib
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

from figure_runs import PICTURES, QUIET_POLICY, QUIET_STAGE, RUNS, TRAINING
from stated import STATED, Results, Stated

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
MARK = "kept.txt"
"""A file in a run's folder: the digest of the results that were kept from it."""
UNSTATED = (AssertionError, ArithmeticError, LookupError, TypeError, ValueError)
"""Errors of a statement whose results are other ones than it is for."""


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


class Outcome(Enum):
    """The outcome of a run that was asked for."""

    KEPT = 0
    FAILED = 1
    NOT_RUN = 3
    """Its policy is missing; what was kept of it before stays."""

    @property
    def words(self) -> str:
        """Return the outcome as it is printed."""
        return self.name.lower().replace("_", " ")


def run(names: Iterable[str]) -> int:
    """Carry out unfinished runs, and keep results and pictures.

    Return 1 if one failed, else 3 if one was not run and has kept figures, else 0.
    """
    outcomes = [_run(name) for name in names]
    for outcome in (Outcome.FAILED, Outcome.NOT_RUN):
        if n := outcomes.count(outcome):
            print(f"{n} of {len(outcomes)} {outcome.words}, see above")
    worst = (one for one in (Outcome.FAILED, Outcome.NOT_RUN) if one in outcomes)
    return next(worst, Outcome.KEPT).value


def _run(name: str) -> Outcome:
    before = results_in(FOLDERS / name)
    # Sweeps and evaluations, which have a plan, try their missing and failed points again.
    if before and not (FOLDERS / name / "sweep.json").exists():
        return _keep(name) if _is_of(FOLDERS / name, RUNS[name]) else Outcome.FAILED
    if QUIET_POLICY in RUNS[name] and (reason := _without_policy(ROOT / QUIET_POLICY)):
        outcome = Outcome.NOT_RUN if _is_kept(name) else Outcome.FAILED
        print(f"{outcome.words}: {name}: {QUIET_POLICY} {reason} with: {TRAINING}")
        return outcome
    return _keep(name) if _carried_out(name) else Outcome.FAILED


def _without_policy(policy: Path) -> str:
    """Return why the policy cannot be used, or nothing; its bits depend on where it was trained."""
    if not policy.exists():
        return "is missing; make it"
    card = policy.with_suffix(".md")
    if not card.exists() or QUIET_STAGE not in card.read_text():
        return f"was not trained by these stages; delete {policy.parent}, and make it"
    return ""


def _carried_out(name: str) -> bool:
    """Return whether the command of a run has succeeded."""
    print(f"{name}: spikeport {RUNS[name]}", flush=True)
    # The last bits of solved decoders depend on the number of threads.
    alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    out = ["--out", str(FOLDERS / name)]
    line = [sys.executable, "-m", "spikeport", *RUNS[name].split(), *out]
    return subprocess.run(line, cwd=ROOT, env=alone, check=False).returncode == 0


def _keep(name: str) -> Outcome:
    """Write the results of a run, and its picture.

    Results that were kept once, and replaced by others since, stay replaced.
    """
    found, kept = results_in(FOLDERS / name), RESULTS / f"{name}.json"
    if not found:
        print(f"{name}: {FOLDERS / name} has no result; delete it to run again")
        return Outcome.FAILED
    text = json.dumps(found, indent=1) + "\n"
    digest, mark = hashlib.sha256(text.encode()).hexdigest(), FOLDERS / name / MARK
    was_kept = mark.exists() and mark.read_text() == digest
    if was_kept and kept.exists() and kept.read_text() != text:
        print(f"{name}: {FOLDERS / name} has other results than those kept; delete it to run again")
        return Outcome.FAILED
    RESULTS.mkdir(exist_ok=True)
    part = kept.with_suffix(".part")  # what took hours is never half-written
    part.write_text(text)
    part.replace(kept)
    mark.write_text(digest)
    if name in PICTURES:
        shutil.copyfile(FOLDERS / name / "figure.png", ROOT / PICTURES[name])
    return Outcome.KEPT


def _is_kept(name: str) -> bool:
    picture = PICTURES.get(name)
    return (RESULTS / f"{name}.json").exists() or bool(picture and (ROOT / picture).exists())


def _is_of(folder: Path, command: str) -> bool:
    """Return whether a folder has the run of a command; compiles do not say what they are of."""
    file = folder / "result.json"
    if not file.exists():
        return True
    words: list[str] = json.loads(file.read_text())["command"]
    # The folder may have been made in another checkout.
    if words[1 : words.index("--out")] == command.split():
        return True
    print(f"{folder.name}: {folder} has a run of another command; delete it to run: {command}")
    return False


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
    """Print statements that differ from their results or cannot be made from them.

    Return 1 if there are any.
    """
    made, differ = 0, 0
    for one in stated:
        missing = [name for name in one.runs if name not in results]
        if missing:
            print(f"not run: {', '.join(missing)} ({one.name}, {one.document})")
            continue
        try:
            found_differing = list(differing(one, results, (root / one.document).read_text()))
        except UNSTATED as error:
            reason = f"{type(error).__name__}: {error}"
            print(f"{one.name} ({one.document}): cannot be stated: {reason}")
            continue
        made += 1
        for found in found_differing:
            differ += 1
            print(f"{found.document}: {one.name}")
            print(f"  results: {found.sentence}")
            print(f"  closest: {found.closest}")
    print(f"{made} of {len(stated)} statements have results; {differ} sentences differ")
    return int(differ > 0 or made < len(stated))


def known(name: str) -> str:
    """Return the name of a run; ArgumentTypeError if there is none of that name."""
    if name not in RUNS:
        raise argparse.ArgumentTypeError(f"no run {name!r}; choose from: {', '.join(RUNS)}")
    return name


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry out runs, or check the documents."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    runs = commands.add_parser("run", help="carry out what is missing")
    runs.add_argument("names", nargs="*", type=known, metavar="NAME")
    commands.add_parser("check", help="compare the documents with the results")
    asked = parser.parse_args(arguments)
    if asked.command == "run":
        return run(asked.names or RUNS)
    return check(read_results())


if __name__ == "__main__":
    sys.exit(main())
