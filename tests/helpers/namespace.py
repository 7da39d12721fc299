"""A network namespace that has only a loopback interface, for tests that open DDS.

DDS listens on all interfaces; in a namespace it can hear nobody else. Processes have a namespace of
their own, too: processes that a failed test leaves behind end with it.
"""

import atexit
import functools
import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import pytest

OWN = ("unshare", "--net", "--pid", "--fork", "--kill-child", "--mount-proc")
ENTER = (*OWN, "sh", "-c", 'ip link set lo up && "$@"', "sh")
CALLED = "result: "
ENDED = "ended: "
SERVE = f"""
import importlib, json, os, sys
functions = vars(importlib.import_module(sys.argv[1]))
for line in sys.stdin:
    if not (child := os.fork()):
        name, arguments = json.loads(line)
        print("{CALLED}" + json.dumps(functions[name](*arguments)), flush=True)
        break
    print("{ENDED}", os.waitpid(child, 0)[1], flush=True)
"""
"""A program that calls functions of a module, each in a process that imports nothing anew."""


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


@functools.cache
def _namespace(module: str) -> subprocess.Popen[str]:
    """Return the program of a module in a namespace, which is there until this process ends."""
    program = [*ENTER, sys.executable, "-c", SERVE, module]
    served = subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(served.communicate)
    return served


def in_namespace(function: Any, *arguments: object, within_s: float = 240) -> Any:
    """Return a function's result in a network namespace; arguments and result go as JSON.

    Functions of a module are called in the same namespace, until one of them fails.
    """
    if missing():
        pytest.skip(missing())
    served = _namespace(function.__module__)
    limit = threading.Timer(within_s, served.kill)
    limit.start()
    try:
        lines = list(_call(served, json.dumps([function.__name__, arguments])))
    finally:
        limit.cancel()
    if not lines or lines[-1] != f"{ENDED} 0\n":
        served.kill()
        _namespace.cache_clear()
        pytest.fail(f"{function.__name__} failed in its namespace; its error is in the log")
    (result,) = (line for line in lines if line.startswith(CALLED))
    return json.loads(result.removeprefix(CALLED))


def _call(served: subprocess.Popen[str], call: str) -> Iterator[str]:
    """Yield the lines that a function prints, up to the one that it has ended."""
    assert served.stdin is not None
    assert served.stdout is not None
    print(call, file=served.stdin, flush=True)
    for line in served.stdout:
        yield line
        if line.startswith(ENDED):
            return
