"""Run of nengo-loihi's own tests with the native backend beside its emulator.

    python -m tests.shadow.run [--report FILE] [options of pytest]

The exit code is pytest's, or 1 if the emulators differed.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

import nengo_loihi
import pytest

from spikeport.compile.loihi.numpy1 import numpy1_semantics
from tests.shadow import suite
from tests.shadow.tally import TALLY

# nengo's plugin does not load under pytest 9
OPTIONS = ("-q", "-p", "no:nengo", "-p", "no:cacheprovider", "--import-mode=importlib")
PACKAGE = Path(nengo_loihi.__file__).parent


def main(arguments: list[str]) -> int:
    """Run the tests, and return the exit code."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--report", type=Path, help="where to write the counts, as JSON")
    options, rest = parser.parse_known_args(arguments)
    report = options.report.absolute() if options.report else None
    with tempfile.TemporaryDirectory() as folder, numpy1_semantics():
        settings = Path(folder, "pytest.ini")  # not this checkout's settings
        settings.write_text("[pytest]\n", encoding="utf-8")
        # tests draw their seeds from their names, which begin with the package's name
        where = ["-c", str(settings), "--rootdir", str(PACKAGE.parent), "--pyargs", PACKAGE.name]
        os.chdir(folder)  # for files that tests write
        code = pytest.main([*OPTIONS, *where, *rest], plugins=[suite])
        os.chdir(PACKAGE)
    if report:
        TALLY.write(report)
    return int(code) or int(bool(TALLY.mismatches))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
