"""A network namespace that has only a loopback interface, for tests that open DDS.

DDS listens on all interfaces; in a namespace it can hear nobody else. Processes have a namespace of
their own, too: processes that a failed test leaves behind end with it.
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
    """Return what a test with DDS lacks here, or an empty text if it lacks nothing."""
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
    """Return a function's result in a network namespace; arguments and result go as JSON."""
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
