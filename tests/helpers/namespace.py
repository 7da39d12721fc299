"""A network of one's own, with a loopback and nothing else, for tests that open DDS.

DDS listens on all interfaces; in a namespace nobody else is there to be heard. Processes have a
namespace of their own, too: what a test that failed leaves behind ends with it.
"""

import functools
import json
import subprocess
import sys
from typing import Any

import pytest

OWN = ("unshare", "--net", "--pid", "--fork", "--kill-child", "--mount-proc")
ENTER = (*OWN, "sh", "-c", 'ip link set lo up && "$@"', "sh")
CALL = """
import importlib, json, sys
module, name, arguments = json.loads(sys.argv[1])
print(json.dumps(getattr(importlib.import_module(module), name)(*arguments)))
"""


@functools.cache
def missing() -> str:
    """Return what a test with DDS lacks here; an empty text if nothing."""
    try:
        import cyclonedds  # noqa: F401
    except ImportError:
        return "cyclonedds is absent: pip install 'spikeport[link]'"
    try:
        entered = subprocess.run([*ENTER, "true"], capture_output=True, text=True, check=False)
    except OSError as error:
        return f"no network namespace: {error}"
    return f"no network namespace: {entered.stderr.strip()}" if entered.returncode else ""


def in_namespace(function: Any, *arguments: object, within_s: float = 240) -> Any:
    """Return what a function of a module returns in a network of its own, both as JSON can say."""
    if missing():
        pytest.skip(missing())
    call = json.dumps([function.__module__, function.__name__, arguments])
    done = subprocess.run(
        [*ENTER, sys.executable, "-c", CALL, call],
        capture_output=True,
        text=True,
        timeout=within_s,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])
