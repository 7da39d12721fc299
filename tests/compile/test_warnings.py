"""The user's filters of warnings after the compiler is imported."""

import subprocess
import sys

import pytest

IMPORTERS = [
    "spikeport.compile",
    "spikeport.compile.pipeline",
    "spikeport.compile.loihi.discretise",
    "spikeport.compile.rewriting.decode_paths",
    "spikeport.backends.registry",
]
"""Modules that import nengo-loihi if they are imported first."""

FILTERS = """
import sys, warnings
warnings.simplefilter("error", UserWarning)
before = list(warnings.filters)
import {module}
added = [one for one in warnings.filters if one not in before]
assert before == [one for one in warnings.filters if one in before]
assert not any(one[1] and "nengo_loihi" in one[1].pattern for one in added), added
if "nengo" in sys.modules:
    from nengo.utils.progress import MemoryLeakWarning
    assert any(one[2] is MemoryLeakWarning for one in added)  # Nengo's own filters stay
else:
    assert added == []
"""


@pytest.mark.slow
@pytest.mark.parametrize("module", IMPORTERS)
def test_importing_the_compiler_neither_warns_nor_changes_filters(module: str) -> None:
    code = FILTERS.format(module=module)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
